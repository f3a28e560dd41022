// The cavity's transducer steps by a constant at one moment of a run.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class SensorOffset final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "sensor-offset",
        .title = "step of the sensor's zero",
        .port = Port::sensor,
        .equations = "p_read = p + step from the moment on, in that run and those after it.",
        .source = "A bubble or a knock at the transducer, an amplifier's range.",
        .looks_like = "From one moment of the session on all readings lie higher or lower, at rest too.",
        .revealed_by = "Rest before and after the motion in every run.",
        .conflicts = {"sensor-drift"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"step_Pa", "Pa", "after the moment", 0.0, -3000.0, 3000.0, 300.0}}};
    return list;
  }
  [[nodiscard]] Stage stage() const override { return Stage::sensors; }
  [[nodiscard]] ChangePoints change_points() const override { return ChangePoints::one; }
  void apply(std::span<const double> values, const Context& context, rig::RigModel& model) const override {
    if (context.change_points.empty()) return;
    const ChangePoint moment = context.change_points.front();
    const double step_kPa = 1e-3 * values[0];
    model.cavity_sensor.emplace_back([=](double pressure_kPa, double time_s, const rig::RunPlace& place) {
      return pressure_kPa + (place.started_s + time_s >= moment.session_s ? step_kPa : 0.0);
    });
  }
};

}  // namespace

const Effect& sensor_offset_effect() {
  static const SensorOffset effect;
  return effect;
}

}  // namespace diastole
