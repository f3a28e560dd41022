// The wall stiffens with strain.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect strain_stiffening_effect() {
  return {{
      .id = "strain-stiffening",
      .title = "stiffening wall",
      .port = Port::specimen,
      .equations = "W = C1/beta (exp(beta (I1 - 3)) - 1); beta = 0 is neo-Hookean.",
      .source = "H. Demiray, J. Biomech. 5 (1972) 309; curves by finite elements (specimen_family.hpp).",
      .looks_like = "The pressure-volume curve bends up where neo-Hookean gel bends down.",
      .revealed_by = "Large and small strokes in one session.",
      .conflicts = {"radius-error", "chamber-back-pressure", "stroke-gain"},
      .parameters = {{"beta", "", "stiffening with I1 - 3", 0.0, 0.0, 3.0, 1.0}},
      .needs_neighbours = true,
      .apply =
          [](EffectValues values, const EffectContext& context, rig::RigModel& model) {
            context.change_specimen(model, rig::Difference::stiffening, values[0]);
          },
      .field_parameters = {{"beta", "", "stiffening with I1 - 3", 0.0, 0.0, 40.0, 4.0}},
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.beta = values[0]; },
  }};
}

}  // namespace diastole
