#pragma once
// The effects that a question is about: those of effect_list.inc and the user's own, read from files. One of the user's with
// the id of a built-in one takes its place.

#include <memory>
#include <string_view>
#include <vector>

#include "estimator/effects/effect.hpp"

namespace diastole {

class EffectLibrary {
 public:
  /// The built-in ones alone.
  EffectLibrary();

  /// Adds an effect, which replaces the one of its id.
  void add(std::shared_ptr<const Effect> effect);

  /// One that is known and is not looked for.
  void set_aside(const Effect& effect) { std::erase(of_rig_, &effect); }

  [[nodiscard]] const std::vector<const Effect*>& all() const { return all_; }
  /// Those that show in recordings of the rig, and are looked for there.
  [[nodiscard]] const std::vector<const Effect*>& of_rig() const { return of_rig_; }
  /// nullptr when no effect has that id.
  [[nodiscard]] const Effect* find(std::string_view id) const;

 private:
  std::vector<const Effect*> all_, of_rig_;
  std::vector<std::shared_ptr<const Effect>> own_;
};

const EffectLibrary& built_in_effects();

}  // namespace diastole
