// The hose's wall yields more than the rig's description says.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect hose_compliance_effect() {
  return {{
      .id = "hose-compliance",
      .title = "soft hose",
      .port = Port::drive,
      .equations = "c: pressure waves are slower, the hose keeps A L / (rho c^2) p.",
      .source = "Moens-Korteweg; the distributed line of estimator/rig/hose_line.hpp.",
      .looks_like = "Ringing at c / (4 L) after every jump of acceleration, in the cavity too once it is "
                    "slow; volume lags at high rates.",
      .revealed_by = "Waveforms with jumps of acceleration at several periods; a pump-end sensor.",
      .conflicts = {"air-bubble-pump"},
      .synergies = {"hose-inertance-excess"},
      .changes = "hose",
      .parameters = {{"wave_speed_m_s", "m/s", "speed of pressure waves in the hose", 400.0, 8.0, 2000.0,
                      80.0, SearchScale::inverse_square}},
      .neutral = [](const rig::RigModel& base) { return std::vector<double>{base.hose.wave_speed_m_s}; },
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.hose.wave_speed_m_s = values[0]; },
  }};
}

}  // namespace diastole
