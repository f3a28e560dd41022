// Samples carry times that are late or early by a constant.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class TriggerDelay final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "trigger-delay",
        .title = "delay of the samples",
        .port = Port::clock,
        .equations = "y(t) shows what was there at t - delay, in all pressure channels.",
        .source = "Start of acquisition against the controller's trigger.",
        .looks_like =
            "All pressures lag by the same time at every rate; residuals are proportional to the "
            "pressures' slopes.",
        .revealed_by = "Waveforms at several rates: a catheter's lag comes with ringing, this one does not.",
        .conflicts = {"catheter-resonance", "clock-skew"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"delay_s", "s", "of the samples", 0.0, -0.2, 0.2, 0.01}}};
    return list;
  }
  [[nodiscard]] Stage stage() const override { return Stage::sensors; }
  void apply(std::span<const double> values, const Context&, rig::RigModel& model) const override {
    model.sample_delay_s += values[0];
  }
};

}  // namespace

const Effect& trigger_delay_effect() {
  static const TriggerDelay effect;
  return effect;
}

}  // namespace diastole
