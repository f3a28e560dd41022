// Air in the cavity, beside the specimen.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect air_bubble_cavity_effect() {
  return {{
      .id = "air-bubble-cavity",
      .title = "air bubble in the cavity",
      .port = Port::specimen,
      .equations = "V_arrived = V_specimen + V_b (1 - (p_a / (p_a + p_cavity))^(1/n)), n = 1.2.",
      .source = "Polytropic gas: bubbles of some millimetres at about a hertz lie between isothermal and "
                "adiabatic.",
      .looks_like =
          "The cavity seems softer by V_b / p_a, a few hundredths of mL/kPa: nearly a smaller stroke.",
      .revealed_by = "The gated volume of the specimen against the piston's, and strokes of different size.",
      .conflicts = {"stroke-gain", "radius-error", "strain-stiffening"},
      .parameters = {{"volume_mL", "mL", "of the gas at atmospheric pressure; any image shows more", 0.0, 0.0,
                      20.0, 10.0}},
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.cavity_gas_mL += values[0]; },
  }};
}

}  // namespace diastole
