// Air between piston and hose.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect air_bubble_pump_effect() {
  return {{
      .id = "air-bubble-pump",
      .title = "air bubble at the pump",
      .port = Port::drive,
      .equations = "V_piston - xi_0 = V_b (1 - (p_a / (p_a + p_pump))^(1/n)), n = 1.2.",
      .source = "Polytropic gas: bubbles of some millimetres at about a hertz lie between isothermal and "
                "adiabatic.",
      .looks_like = "With the hose's inertance a spring: the volume in the cavity overshoots, pressures ring "
                    "at some Hz after each turn.",
      .revealed_by = "Fast strokes and a sensor at the pump; the same stroke slowly shows almost nothing.",
      .conflicts = {"hose-compliance"},
      .synergies = {"hose-inertance-excess"},
      .parameters = {{"volume_mL", "mL", "of the gas at atmospheric pressure", 0.0, 0.0, 50.0, 3.0}},
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.pump_gas_mL += values[0]; },
  }};
}

}  // namespace diastole
