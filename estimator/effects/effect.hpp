#pragma once
// An effect: something physical that the base rig does not hold and a real one may. Simulation and estimation use the
// same: an effect's parameters at their neutral values are the base model exactly, and its text is what `diastole
// effects` shows.
//
// To add one: a file NAME.cpp in this folder that defines `Effect NAME_effect()`, its declaration, and a line in
// effect_list.inc. The tests over the list then check that it is neutral, differentiable, found again in its own
// simulated data, and silent without cause; docs/effects.md is made from the declarations.

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "estimator/effects/field_model.hpp"
#include "estimator/inference/parameter_space.hpp"
#include "estimator/rig/rig_model.hpp"
#include "estimator/rig/specimen_curve.hpp"

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
  bool seen_at_rest = false;  ///< the part by which the inner radius is larger: an image at rest shows it
};

/// Something that happened at a moment of one run: a step of the sensor, steps lost.
struct ChangePoint {
  std::string run;
  double time_s = 0.0;     ///< of the run
  double session_s = 0.0;  ///< the same since the session's first run began
  bool operator==(const ChangePoint&) const = default;
};

/// How many change points an effect has; they are searched (estimator/explain/rig/event_scan.hpp). What begins at the
/// only one lasts for the rest of the session, what begins at one of several for the rest of its run.
enum class ChangePoints { none, one, several };

/// Whether the fluid's motion changes, or only what the instruments show of it.
enum class Stage { plant, sensors };

/// What an effect needs besides the model to be added to it.
struct EffectContext {
  const rig::SpecimenCurves& family;
  std::span<const ChangePoint> change_points = {};
  bool low_fidelity = false;  ///< specimens' neighbours may be (specimen_curve.hpp)

  /// The model's curve becomes that of a specimen with another value; 0 is the specimen itself.
  void change_specimen(rig::RigModel& model, rig::Difference what, double value) const {
    if (value == 0.0) return;
    model.curve = model.curve.plus(family.neighbour(what, value, low_fidelity), 1.0, 1.0)
                      .plus(family.plain(), 1.0, -1.0);
  }
};

/// A parameter in images that is a direction: where its search starts is decided by what a little of the effect would gain
/// in each of the directions of half a turn.
struct FieldDirection {
  size_t parameter;  ///< its place in field_parameters
  double half_turn;  ///< in its unit; there the effect is the same again
};

/// Whether an effect is the same all around the specimen's axis, or an Inclusion, whose place is searched on a lattice and whose
/// parameters are those of stiff_inclusion.cpp in their order.
enum class FieldShape { round, inclusion };

/// Specimens that can have a field effect: gel is the neo-Hookean annulus between held plates, other is any other specimen that
/// `fit` takes; fibred and hung are others with fibres and with one held end.
enum class FieldSpecimen { gel, any, other, fibred, hung };
/// "images of specimens with fibres"
std::string_view name_of(FieldSpecimen specimen);

/// One number a parameter, in their order.
using EffectValues = std::span<const double>;

/// All that there is to say of an effect; every text is shown to users.
struct EffectDeclaration {
  std::string_view id;     ///< "hose-compliance": kept for ever
  std::string_view title;  ///< a few words
  Port port;
  std::string_view equations;                    ///< what changes, in the model's symbols
  std::string_view source;                       ///< where the equations are from
  std::string_view looks_like;                   ///< in the recordings
  std::string_view revealed_by;                  ///< the experiment that separates it from others
  std::vector<std::string_view> conflicts = {};  ///< ids that look alike in some data: tried in its place
  std::vector<std::string_view> synergies = {};  ///< ids that only show together
  /// "hose": the part of the rig that is another one then, of whose tolerances references know nothing.
  std::string_view changes = {};
  /// run_ids of the recordings that it was learnt from: these cannot show that it is there.
  std::vector<std::string_view> learnt_from = {};

  // In recordings of the rig, if it shows there.
  std::vector<EffectParameter> parameters = {};
  ChangePoints change_points = ChangePoints::none;
  Stage stage = Stage::plant;
  bool keeps_modulus = true;  ///< at all times, so that a test beside the session measures the same
  bool needs_neighbours =
      false;  ///< only a specimen with computed neighbours can have it (specimen_curve.hpp)
  /// The values that leave `base` as it is; without: the parameters' neutral ones.
  std::function<std::vector<double>(const rig::RigModel& base)> neutral = nullptr;
  /// The model's curve and modulus must be set.
  std::function<void(EffectValues values, const EffectContext&, rig::RigModel&)> apply = nullptr;

  // In images of the specimen (field_model.hpp), if it shows there. The first parameter is the effect's size.
  std::vector<EffectParameter> field_parameters = {};
  /// Parameters after so many are only freed once those have been found; without: all are free at once.
  std::optional<size_t> field_essentials = {};
  FieldShape field_shape = FieldShape::round;
  FieldSpecimen field_specimen = FieldSpecimen::gel;
  std::optional<FieldDirection> field_direction = {};
  std::vector<double> (*field_neutral)(const FieldModel& base) = nullptr;
  void (*apply_to_field)(EffectValues values, FieldModel&) = nullptr;
};

/// A declared effect, as the searches ask for it.
class Effect {
 public:
  Effect(EffectDeclaration declared) : declared_(std::move(declared)) {}
  Effect(const Effect&) = delete;
  Effect& operator=(const Effect&) = delete;

  [[nodiscard]] const EffectDeclaration& text() const { return declared_; }
  /// Empty: it does not show in recordings of the rig.
  [[nodiscard]] std::span<const EffectParameter> parameters() const { return declared_.parameters; }
  [[nodiscard]] Stage stage() const { return declared_.stage; }
  [[nodiscard]] ChangePoints change_points() const { return declared_.change_points; }
  [[nodiscard]] bool keeps_modulus() const { return declared_.keeps_modulus; }
  /// Whether the specimen can have it and recordings would show it.
  [[nodiscard]] bool fits(const rig::SpecimenCurves& family) const;
  [[nodiscard]] std::vector<double> neutral(const rig::RigModel& base) const;
  void apply(EffectValues values, const EffectContext& context, rig::RigModel& model) const {
    if (declared_.apply != nullptr) declared_.apply(values, context, model);
  }

  /// Empty: it does not show in images.
  [[nodiscard]] std::span<const EffectParameter> field_parameters() const {
    return declared_.field_parameters;
  }
  [[nodiscard]] size_t field_essentials() const {
    return declared_.field_essentials.value_or(field_parameters().size());
  }
  [[nodiscard]] bool is_inclusion() const { return declared_.field_shape == FieldShape::inclusion; }
  [[nodiscard]] std::optional<FieldDirection> field_direction() const { return declared_.field_direction; }
  [[nodiscard]] std::vector<double> field_neutral(const FieldModel& base) const;
  void apply_to_field(EffectValues values, FieldModel& model) const {
    if (declared_.apply_to_field != nullptr) declared_.apply_to_field(values, model);
  }

 private:
  EffectDeclaration declared_;
};

/// The effects of effect_list.inc, in its order. They live as long as the program.
const std::vector<const Effect*>& all_effects();

/// Those of them that show in recordings of the rig.
const std::vector<const Effect*>& rig_effects();
/// Those of them that show in images of gel, and of any other specimen; FieldSpecimen says which.
const std::vector<const Effect*>& field_effects();
const std::vector<const Effect*>& specimen_effects();
/// The one of them that is an inclusion.
const Effect& inclusion_effect();

/// nullptr when no effect has that id.
const Effect* find_effect(std::string_view id);

}  // namespace diastole
