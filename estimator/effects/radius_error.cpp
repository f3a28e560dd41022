// The cavity's true radius is another than the study's.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class RadiusError final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "radius-error",
        .title = "error of the inner radius",
        .port = Port::specimen,
        .equations = "R_inner (1 + fraction) in the specimen's mesh.",
        .source = "Geometry; curves by finite elements (specimen_family.hpp).",
        .looks_like =
            "Curvature of the pressure-volume curve, and a modulus that differs from an independent "
            "test's.",
        .revealed_by = "Gated volumes and strokes of different size; the field.",
        .conflicts = {"stroke-gain", "end-bond-slip", "strain-stiffening", "chamber-back-pressure"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"fraction", "", "part by which the inner radius is larger; any image shows more", 0.0, -0.08, 0.08,
          0.04, SearchScale::linear, true}}};
    return list;
  }
  [[nodiscard]] bool fits(const rig::SpecimenCurves& family) const override {
    return family.has_neighbours();
  }
  void apply(std::span<const double> values, const Context& context, rig::RigModel& model) const override {
    if (values[0] == 0.0) return;
    model.curve =
        model.curve.plus(context.family.with_inner_radius(values[0], context.low_fidelity), 1.0, 1.0)
            .plus(context.family.plain(), 1.0, -1.0);
  }
  [[nodiscard]] std::span<const EffectParameter> field_parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"true_inner_radius_mm", "mm", "inner radius of the specimen itself", 22.5, 5.0, 45.0, 23.4}}};
    return list;
  }
  [[nodiscard]] std::vector<double> field_neutral(const FieldModel& base) const override {
    return {base.inner_radius_mm};
  }
  void apply_to_field(std::span<const double> values, FieldModel& model) const override {
    model.inner_radius_mm = values[0];
  }
};

}  // namespace

const Effect& radius_error_effect() {
  static const RadiusError effect;
  return effect;
}

}  // namespace diastole
