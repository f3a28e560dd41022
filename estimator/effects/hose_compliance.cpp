// The hose's wall yields more than the rig's description says.

#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class HoseCompliance final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "hose-compliance",
        .title = "soft hose",
        .port = Port::drive,
        .equations = "c: pressure waves are slower, the hose keeps A L / (rho c^2) p.",
        .source = "Moens-Korteweg; the distributed line of estimator/rig/hose_line.hpp.",
        .looks_like =
            "Ringing at c / (4 L) after every jump of acceleration, in the cavity too once it is "
            "slow; volume lags at high rates.",
        .revealed_by = "Waveforms with jumps of acceleration at several periods; a pump-end sensor.",
        .conflicts = {"air-bubble-pump"},
        .synergies = {"hose-inertance-excess"},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 1> list{
        {{"wave_speed_m_s", "m/s", "speed of pressure waves in the hose", 400.0, 8.0, 2000.0, 80.0,
          SearchScale::inverse_square}}};
    return list;
  }
  [[nodiscard]] std::vector<double> neutral(const rig::RigModel& base) const override {
    return {base.hose.wave_speed_m_s};
  }
  void apply(std::span<const double> values, const Context&, rig::RigModel& model) const override {
    model.hose.wave_speed_m_s = values[0];
  }
};

}  // namespace

const Effect& hose_compliance_effect() {
  static const HoseCompliance effect;
  return effect;
}

}  // namespace diastole
