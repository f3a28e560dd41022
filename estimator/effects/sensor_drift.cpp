// The cavity's transducer wanders with time, anew in each run.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect sensor_drift_effect() {
  return {{
      .id = "sensor-drift",
      .title = "drift of the cavity sensor",
      .port = Port::sensor,
      .equations = "p_read = p + rate (t - t_run).",
      .source = "Amplifiers are zeroed when a run begins.",
      .looks_like = "The same slope in time in all runs, at rest too, whatever the pressure.",
      .revealed_by = "A rest at the end of every run.",
      .conflicts = {"temperature-drift", "sensor-offset"},
      .parameters = {{"rate_Pa_s", "Pa/s", "of the reading", 0.0, -50.0, 50.0, 4.0}},
      .stage = Stage::sensors,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double rate_kPa_s = 1e-3 * values[0];
            model.cavity_sensor.emplace_back([rate_kPa_s](const rig::RunPlace&) {
              return [rate_kPa_s](double pressure_kPa, double time_s) {
                return pressure_kPa + rate_kPa_s * time_s;
              };
            });
          },
  }};
}

}  // namespace diastole
