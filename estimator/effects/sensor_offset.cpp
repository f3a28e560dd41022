// The cavity's transducer steps by a constant at one moment of a run.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect sensor_offset_effect() {
  return {{
      .id = "sensor-offset",
      .title = "step of the sensor's zero",
      .port = Port::sensor,
      .equations =
          "p_read = p + step from the moment on, in that run and those after it; in images the frames' "
          "pressures are read with one and the same offset.",
      .source = "A bubble or a knock at the transducer, an amplifier's range.",
      .looks_like = "From one moment of the session on all readings lie higher or lower, at rest too.",
      .revealed_by = "Rest before and after the motion in every run.",
      .conflicts = {"sensor-drift"},
      .parameters = {{"step_Pa", "Pa", "after the moment", 0.0, -3000.0, 3000.0, 300.0}},
      .change_points = ChangePoints::one,
      .stage = Stage::sensors,
      .apply =
          [](EffectValues values, const EffectContext& context, rig::RigModel& model) {
            if (context.change_points.empty()) return;
            const ChangePoint moment = context.change_points.front();
            const double step_kPa = 1e-3 * values[0];
            model.cavity_sensor.emplace_back([=](const rig::RunPlace& place) {
              return [=, started_s = place.started_s](double pressure_kPa, double time_s) {
                return pressure_kPa + (started_s + time_s >= moment.session_s ? step_kPa : 0.0);
              };
            });
          },
      .field_parameters = {{"offset_kPa", "kPa", "of the frames' pressures, measured less true", 0.0, -2.0,
                            2.0, 0.2}},
      .field_specimen = FieldSpecimen::other,
      .apply_to_field = [](EffectValues values, FieldModel& model) { model.pressure_offset_kPa = values[0]; },
  }};
}

}  // namespace diastole
