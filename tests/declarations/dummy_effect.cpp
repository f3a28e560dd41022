// The cavity's transducer bends.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect dummy_effect() {
  return {{
      .id = "dummy",
      .title = "bent reading of the cavity sensor",
      .port = Port::sensor,
      .equations = "p_read = p (1 + bend p).",
      .source = "None: it shows that an effect is one file and one line.",
      .looks_like = "High pressures read too high.",
      .revealed_by = "A second sensor.",
      .conflicts = {"sensor-gain"},
      .parameters = {{"bend_per_kPa", "1/kPa", "of the reading", 0.0, -0.1, 0.1, 0.02}},
      .stage = Stage::sensors,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double bend_per_kPa = values[0];
            model.cavity_sensor.emplace_back([bend_per_kPa](const rig::RunPlace&) {
              return [bend_per_kPa](double pressure_kPa, double) {
                return pressure_kPa * (1.0 + bend_per_kPa * pressure_kPa);
              };
            });
          },
  }};
}

}  // namespace diastole
