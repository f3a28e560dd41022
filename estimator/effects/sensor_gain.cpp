// The cavity's transducer reads in another scale.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect sensor_gain_effect() {
  return {{
      .id = "sensor-gain",
      .title = "gain of the cavity sensor",
      .port = Port::sensor,
      .equations = "p_read = (1 + gain) p.",
      .source = "Calibration.",
      .looks_like = "All cavity pressures larger by one factor: with one sensor nearly the modulus itself.",
      .revealed_by = "A second sensor, at the pump, during rest or slow motion.",
      .conflicts = {"radius-error"},
      .parameters = {{"gain", "", "part by which the reading exceeds the pressure", 0.0, -0.3, 0.3, 0.05}},
      .stage = Stage::sensors,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double factor = 1.0 + values[0];
            model.cavity_sensor.emplace_back([factor](const rig::RunPlace&) {
              return [factor](double pressure_kPa, double) { return factor * pressure_kPa; };
            });
          },
  }};
}

}  // namespace diastole
