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
            if (values[0] == 0.0) return;
            model.curve =
                model.curve.plus(context.family.stiffened(values[0], context.low_fidelity), 1.0, 1.0)
                    .plus(context.family.plain(), 1.0, -1.0);
          },
      .field_parameters = {{"beta", "", "stiffening with I1 - 3", 0.0, 0.0, 40.0, 4.0}},
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.beta = values[0]; },
  }};
}

}  // namespace diastole
