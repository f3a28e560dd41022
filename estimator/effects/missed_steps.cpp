// The motor loses steps at single moments.

#include <algorithm>
#include <array>
#include <vector>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

constexpr double stall_s = 0.05;  ///< in which the steps are lost

class MissedSteps final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "missed-steps",
        .title = "missed steps",
        .port = Port::drive,
        .equations =
            "V_piston = V_commanded - lost_mL times the number of moments passed, each towards the "
            "side that the piston moved to.",
        .source = "A stepper that falls out of step loses whole electrical cycles at once.",
        .looks_like =
            "From a moment on the pressure of all later phases is shifted, first visible where the "
            "load was highest.",
        .revealed_by = "A homing after the run, which counts the steps.",
        .conflicts = {"backlash", "cannula-leak-cavity"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"lost_mL", "mL", "volume lost each time", 0.0, -3.0, 3.0, 0.25}}};
    return list;
  }
  [[nodiscard]] Occasions occasions() const override { return Occasions::several; }
  void apply(std::span<const double> values, const Context& context, rig::RigModel& model) const override {
    const double lost_mL = values[0];
    const std::vector<Occasion> moments(context.occasions.begin(), context.occasions.end());
    if (lost_mL == 0.0 || moments.empty()) return;
    model.drive.emplace_back([=](rig::DriveTrace& trace, const rig::RunPlace& place) {
      for (const Occasion& moment : moments) {
        if (moment.run != place.name) continue;
        for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
          const double s = std::clamp((trace.time_s(k) - moment.time_s) / stall_s + 0.5, 0.0, 1.0);
          trace.volume_mL[k] -= lost_mL * s;
        }
      }
      trace.differentiate();
    });
  }
};

}  // namespace

const Effect& missed_steps_effect() {
  static const MissedSteps effect;
  return effect;
}

}  // namespace diastole
