// The motor loses steps at single moments.

#include <array>
#include <cmath>
#include <vector>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class MissedSteps final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "missed-steps",
        .title = "missed steps",
        .port = Port::drive,
        .equations =
            "V_piston = V_commanded - lost_mL sum 1 / (1 + exp(-(t - t_i) / stall)) over the moments "
            "t_i.",
        .source = "A stepper that falls out of step loses whole electrical cycles at once.",
        .looks_like =
            "From a moment on the pressure of all later phases is shifted, first visible where the "
            "load was highest.",
        .revealed_by = "A homing after the run, which counts the steps.",
        .conflicts = {"cannula-leak-cavity"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 2> list{
        {{"lost_mL", "mL", "volume lost each time", 0.0, -3.0, 3.0, 0.25},
         {"stall_s", "s", "time constant of the loss", 0.012, 0.004, 0.05, 0.012, SearchScale::logarithmic}}};
    return list;
  }
  [[nodiscard]] Occasions occasions() const override { return Occasions::several; }
  void apply(std::span<const double> values, const Context& context, rig::RigModel& model) const override {
    const double lost_mL = values[0];
    const double stall_s = values[1];
    const std::vector<Occasion> moments(context.occasions.begin(), context.occasions.end());
    if (lost_mL == 0.0 || moments.empty()) return;
    model.drive.emplace_back([=](rig::DriveTrace& trace, const rig::RunPlace& place) {
      for (const Occasion& moment : moments) {
        if (moment.run != place.name) continue;
        for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
          const double part = 1.0 / (1.0 + std::exp((moment.time_s - trace.time_s(k)) / stall_s));
          const double speed = part * (1.0 - part) / stall_s;
          trace.volume_mL[k] -= lost_mL * part;
          trace.flow_mL_per_s[k] -= lost_mL * speed;
          trace.acceleration_mL_per_s2[k] -= lost_mL * speed * (1.0 - 2.0 * part) / stall_s;
        }
      }
    });
  }
};

}  // namespace

const Effect& missed_steps_effect() {
  static const MissedSteps effect;
  return effect;
}

}  // namespace diastole
