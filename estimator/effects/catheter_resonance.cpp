// The catheter responds more slowly than the rig's description says.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect catheter_resonance_effect() {
  return {{
      .id = "catheter-resonance",
      .title = "slow catheter",
      .port = Port::sensor,
      .equations = "p'' + 2 zeta w p' + w^2 p = w^2 p_cavity, w = 2 pi f0.",
      .source = "Second-order fluid column and membrane, as a step test measures it.",
      .looks_like = "The cavity's pressure lags by zeta / (pi f0) and rings after jumps; bubbles in the "
                    "catheter do it.",
      .revealed_by = "Fast waveforms with jumps; a step test of the catheter (diastole catheter).",
      .conflicts = {"trigger-delay"},
      .changes = "catheter",
      .parameters = {{"f0_Hz", "Hz", "resonance", 60.0, 3.0, 200.0, 15.0, SearchScale::inverse_square},
                     {"zeta", "", "part of critical damping", 0.6, 0.05, 2.0, 0.4}},
      .stage = Stage::sensors,
      .neutral =
          [](const rig::RigModel& base) {
            return std::vector<double>{base.catheter.resonance_Hz, base.catheter.damping};
          },
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            model.catheter = {values[0], values[1]};
          },
  }};
}

}  // namespace diastole
