// Air in the cavity, beside the specimen.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class AirBubbleCavity final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "air-bubble-cavity",
        .title = "air bubble in the cavity",
        .port = Port::specimen,
        .equations = "V_arrived = V_specimen + V_b (1 - (p_a / (p_a + p_cavity))^(1/n)), n = 1.2.",
        .source =
            "Polytropic gas: bubbles of some millimetres at about a hertz lie between isothermal and "
            "adiabatic.",
        .looks_like =
            "The cavity seems softer by V_b / p_a, a few hundredths of mL/kPa: nearly a smaller "
            "stroke.",
        .revealed_by =
            "The gated volume of the specimen against the piston's, and strokes of different size.",
        .conflicts = {"stroke-gain", "radius-error", "strain-stiffening"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"volume_mL", "mL", "of the gas at atmospheric pressure; any image shows more", 0.0, 0.0, 20.0,
          10.0}}};
    return list;
  }
  void apply(std::span<const double> values, const Context&, rig::RigModel& model) const override {
    model.cavity_gas_mL += values[0];
  }
};

}  // namespace

const Effect& air_bubble_cavity_effect() {
  static const AirBubbleCavity effect;
  return effect;
}

}  // namespace diastole
