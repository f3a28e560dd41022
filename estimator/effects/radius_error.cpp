// The cavity's true radius is another than the study's.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect radius_error_effect() {
  return {{
      .id = "radius-error",
      .title = "error of the inner radius",
      .port = Port::specimen,
      .equations = "R_inner (1 + fraction) in the specimen's mesh.",
      .source = "Geometry; curves by finite elements (specimen_family.hpp).",
      .looks_like =
          "Curvature of the pressure-volume curve, and a modulus that differs from an independent test's.",
      .revealed_by = "Gated volumes and strokes of different size; the field.",
      .conflicts = {"stroke-gain", "end-bond-slip", "strain-stiffening", "chamber-back-pressure"},
      .parameters = {{"fraction", "", "part by which the inner radius is larger; any image shows more", 0.0,
                      -0.08, 0.08, 0.04, SearchScale::linear, true}},
      .needs_neighbours = true,
      .apply =
          [](EffectValues values, const EffectContext& context, rig::RigModel& model) {
            context.change_specimen(model, rig::Difference::inner_radius, values[0]);
          },
      .field_parameters = {{"true_inner_radius_mm", "mm", "inner radius of the specimen itself", 22.5, 5.0,
                            45.0, 23.4}},
      .field_neutral = [](const FieldModel& base) { return std::vector<double>{base.inner_radius_mm}; },
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.inner_radius_mm = values[0]; },
  }};
}

}  // namespace diastole
