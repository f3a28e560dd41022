// The bond between specimen and plates yields across the axis.

#include "estimator/effects/effect.hpp"

namespace diastole {

constexpr double as_good_as_held = 1000.0;

Effect end_bond_slip_effect() {
  return {{
      .id = "end-bond-slip",
      .title = "slipping end bonds",
      .port = Port::specimen,
      .equations = "At the ends u_z = 0 and traction = -u / compliance across the axis; compliance 0 is the "
                   "fixed end.",
      .source =
          "Spring bond (estimator/fe/spring_bond.hpp); curves by finite elements (specimen_family.hpp).",
      .looks_like = "The specimen seems softer, with a little less curvature.",
      .revealed_by = "The field near the plates; gated volumes with an independent modulus.",
      .conflicts = {"radius-error", "stroke-gain"},
      .parameters = {{"bond_compliance_mm_per_kPa", "mm/kPa", "slip across the axis by traction", 0.0, 0.0,
                      10.0, 1.0}},
      .needs_neighbours = true,
      .apply =
          [](EffectValues values, const EffectContext& context, rig::RigModel& model) {
            context.change_specimen(model, rig::Difference::end_slip, values[0] * model.modulus_kPa);
          },
      .field_parameters = {{"bond_stiffness_kPa_per_mm", "kPa/mm",
                            "traction across the axis for slip; 1000 is as good as held", as_good_as_held,
                            0.02, as_good_as_held, 1.0, SearchScale::logarithmic}},
      .apply_to_field =
          [](EffectValues values, FieldModel& model) {
            if (values[0] < as_good_as_held) model.bond_stiffness_kPa_per_mm = values[0];
          },
  }};
}

}  // namespace diastole
