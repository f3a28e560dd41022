// The wall stiffens with strain.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class StrainStiffening final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "strain-stiffening",
        .title = "stiffening wall",
        .port = Port::specimen,
        .equations = "W = C1/beta (exp(beta (I1 - 3)) - 1); beta = 0 is neo-Hookean.",
        .source = "H. Demiray, J. Biomech. 5 (1972) 309; curves by finite elements (specimen_family.hpp).",
        .looks_like = "The pressure-volume curve bends up where neo-Hookean gel bends down.",
        .revealed_by = "Large and small strokes in one session.",
        .conflicts = {"radius-error", "chamber-back-pressure", "stroke-gain"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"beta", "", "stiffening with I1 - 3", 0.0, 0.0, 3.0, 1.0}}};
    return list;
  }
  [[nodiscard]] bool fits(const rig::SpecimenCurves& family) const override {
    return family.has_neighbours();
  }
  void apply(std::span<const double> values, const Context& context, rig::RigModel& model) const override {
    if (values[0] == 0.0) return;
    model.curve = model.curve.plus(context.family.stiffened(values[0], context.low_fidelity), 1.0, 1.0)
                      .plus(context.family.plain(), 1.0, -1.0);
  }
  [[nodiscard]] std::span<const EffectParameter> field_parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"beta", "", "stiffening with I1 - 3", 0.0, 0.0, 40.0, 4.0}}};
    return list;
  }
  void apply_to_field(std::span<const double> values, FieldModel& model) const override {
    model.beta = values[0];
  }
};

}  // namespace

const Effect& strain_stiffening_effect() {
  static const StrainStiffening effect;
  return effect;
}

}  // namespace diastole
