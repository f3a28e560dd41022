#include "estimator/effects/effect_library.hpp"

#include <algorithm>
#include <utility>

namespace diastole {

EffectLibrary::EffectLibrary() : all_(all_effects()), of_rig_(rig_effects()) {}

void EffectLibrary::add(std::shared_ptr<const Effect> effect) {
  const auto put = [&](std::vector<const Effect*>& list) {
    const auto known =
        std::ranges::find(list, effect->text().id, [](const Effect* other) { return other->text().id; });
    if (known == list.end()) {
      list.push_back(effect.get());
    } else {
      *known = effect.get();
    }
  };
  put(all_);
  if (!effect->parameters().empty()) put(of_rig_);
  own_.push_back(std::move(effect));
}

const Effect* EffectLibrary::find(std::string_view id) const {
  const auto found = std::ranges::find(all_, id, [](const Effect* effect) { return effect->text().id; });
  return found == all_.end() ? nullptr : *found;
}

const EffectLibrary& built_in_effects() {
  static const EffectLibrary library;
  return library;
}

}  // namespace diastole
