// The piston displaces more or less than the steps say.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect stroke_gain_effect() {
  return {{
      .id = "stroke-gain",
      .title = "stroke gain",
      .port = Port::drive,
      .equations = "V_piston = (1 + gain) V_commanded.",
      .source = "Geometry: a bore or a screw pitch that differs from the nominal one.",
      .looks_like = "All volumes and pressures larger by one factor; the specimen's curvature and the gated "
                    "volume tell it from stiffness.",
      .revealed_by = "Gated volumes, or strokes of very different size.",
      .conflicts = {"radius-error", "strain-stiffening", "chamber-back-pressure", "end-bond-slip",
                    "air-bubble-cavity"},
      .parameters = {{"gain", "", "part by which the displaced volume exceeds the commanded one", 0.0, -0.15,
                      0.15, 0.04}},
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double factor = 1.0 + values[0];
            // Of turns, as steps that are counted wrong are: the angle of the screw's own error goes with it. A bore alone would leave it.
            model.turns.emplace_back([factor](rig::DriveTrace& trace, const rig::RunPlace&) {
              for (auto* series : {&trace.volume_mL, &trace.flow_mL_per_s, &trace.acceleration_mL_per_s2})
                for (double& value : *series)
                  value *= factor;
            });
          },
  }};
}

}  // namespace diastole
