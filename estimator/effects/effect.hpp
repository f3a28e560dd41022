#pragma once
// An effect: something physical that the base rig does not hold and a real one may. Simulation and estimation use the
// same: an effect's parameters at their neutral values are the base model exactly, and its text is what `diastole
// effects` shows.
//
// To add one: a file NAME.cpp in this folder that defines `const Effect& NAME_effect()`, and a line in
// effect_list.inc. The tests over the list then check that it is neutral, differentiable, found again in its own
// simulated data, and silent without cause.

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/effects/field_model.hpp"
#include "estimator/inference/parameter.hpp"
#include "estimator/rig/rig_model.hpp"
#include "estimator/rig/specimen_curves.hpp"

namespace diastole {

/// Where in the chain an effect enters.
enum class Port { drive, specimen, sensor, clock, field };
std::string_view name_of(Port port);

/// In which coordinate a parameter is searched: where the rig's answer is nearest to linear in it.
using SearchScale = inference::Scale;

struct EffectParameter {
  std::string_view name;     ///< with its unit, as in the explanation: "wave_speed_m_s"
  std::string_view unit;     ///< for people: "m/s"
  std::string_view meaning;  ///< one line
  double neutral;            ///< gives the base model, for the paper's rig (Effect::neutral for any)
  double lower;              ///< bounds of what is physical
  double upper;
  double typical;  ///< a size worth finding: where searches start and tests simulate
  SearchScale scale = SearchScale::linear;
  bool seen_at_rest =
      false;  ///< the part by which the inner radius is larger: an image of the specimen at rest shows it
};

/// A parameter in images that is a direction: where its search starts is decided by what a little of the effect would gain
/// at each of the directions of a half turn.
struct FieldDirection {
  size_t parameter;  ///< its place in field_parameters()
  double half_turn;  ///< in its unit; there the effect is the same again
};

/// What effects tell about themselves; every text is shown to users.
struct EffectText {
  std::string_view id;     ///< "hose-compliance": kept for ever (docs/effects.md)
  std::string_view title;  ///< a few words
  Port port;
  std::string_view equations;                    ///< what changes, in the model's symbols
  std::string_view source;                       ///< where the equations are from
  std::string_view looks_like;                   ///< in the recordings
  std::string_view revealed_by;                  ///< the experiment that separates it from others
  std::vector<std::string_view> conflicts = {};  ///< ids that look alike in some data
  std::vector<std::string_view> synergies = {};  ///< ids that only show together
};

/// Something that happened at a moment of one run: a step of the sensor, steps lost.
struct ChangePoint {
  std::string run;
  double time_s = 0.0;     ///< of the run
  double session_s = 0.0;  ///< the same since the session's first run began
};

/// How many change_points an effect has; they are searched (estimator/rig_fit/change_point_search.hpp). What begins at the only one
/// lasts for the rest of the session, what begins at one of several for the rest of its run.
enum class ChangePoints { none, one, several };

/// Whether the fluid's motion changes, or only what the instruments show of it.
enum class Stage { plant, sensors };

class Effect {
 public:
  virtual ~Effect() = default;

  [[nodiscard]] virtual const EffectText& text() const = 0;
  [[nodiscard]] virtual std::span<const EffectParameter> parameters() const = 0;
  [[nodiscard]] virtual Stage stage() const { return Stage::plant; }
  [[nodiscard]] virtual ChangePoints change_points() const { return ChangePoints::none; }
  /// Whether the specimen's modulus is the same at every time, so that a test beside the session measures it too.
  [[nodiscard]] virtual bool keeps_modulus() const { return true; }
  /// Whether the specimen can have it.
  [[nodiscard]] virtual bool fits(const rig::SpecimenCurves&) const { return true; }
  /// The values that leave `base` as it is.
  [[nodiscard]] virtual std::vector<double> neutral(const rig::RigModel& base) const;

  /// What apply needs besides the model.
  struct Context {
    const rig::SpecimenCurves& family;
    std::span<const ChangePoint> change_points = {};
    bool low_fidelity = false;  ///< specimens' neighbours may be (specimen_curves.hpp)
  };
  /// Adds itself to the model. `values`: one a parameter. The model's curve and modulus must be set.
  virtual void apply(std::span<const double> values, const Context& context, rig::RigModel& model) const = 0;

  // The same effect in images of the specimen (field_model.hpp), if it shows there.

  /// Empty: it does not. The first is the effect's size; those after `field_essentials` are only freed once the others
  /// have been found.
  [[nodiscard]] virtual std::span<const EffectParameter> field_parameters() const { return {}; }
  [[nodiscard]] virtual size_t field_essentials() const { return field_parameters().size(); }
  /// Whether it is an Inclusion, whose parameters are those of `stiff_inclusion.cpp` in their order: it has a place, which is
  /// searched on a lattice. All others are the same all around the axis.
  [[nodiscard]] virtual bool is_inclusion() const { return false; }
  [[nodiscard]] virtual std::optional<FieldDirection> field_direction() const { return {}; }
  /// The values that leave `base` as it is.
  [[nodiscard]] virtual std::vector<double> field_neutral(const FieldModel& base) const;
  /// Adds itself to the model. `values`: one for each of field_parameters().
  virtual void apply_to_field(std::span<const double>, FieldModel&) const {}
};

/// An effect that shows in images only: recordings of the rig cannot have it.
class FieldEffect : public Effect {
 public:
  [[nodiscard]] std::span<const EffectParameter> parameters() const final { return {}; }
  [[nodiscard]] bool fits(const rig::SpecimenCurves&) const final { return false; }
  void apply(std::span<const double>, const Context&, rig::RigModel&) const final {}
};

/// The effects of effect_list.inc, in its order. They live as long as the program.
const std::vector<const Effect*>& all_effects();

/// Those of them that show in recordings of the rig.
const std::vector<const Effect*>& rig_effects();
/// Those of them that show in images of the specimen.
const std::vector<const Effect*>& field_effects();

/// The one of them that is an inclusion.
const Effect& inclusion_effect();

/// nullptr when no effect has that id.
const Effect* find_effect(std::string_view id);

}  // namespace diastole
