// Play between screw and piston.

#include <algorithm>
#include <array>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

class Backlash final : public Effect {
 public:
  [[nodiscard]] const EffectText& text() const override {
    static const EffectText text{
        .id = "backlash",
        .title = "backlash",
        .port = Port::drive,
        .equations =
            "The piston rests while the nut crosses the play b, and follows at its flank else; at the "
            "start slack b of it lie ahead.",
        .source = "Play, the hysteresis operator of M. A. Krasnoselskii.",
        .looks_like = "Flat pieces of volume after each turn, then a knock; the stroke is shorter by b.",
        .revealed_by = "Turns at different speeds; a hold shows no loss of the plateau, only of the stroke.",
        .conflicts = {"missed-steps", "stroke-gain"},
        .synergies = {},
    };
    return text;
  }
  [[nodiscard]] std::span<const EffectParameter> parameters() const override {
    static constexpr std::array<EffectParameter, 2> list{
        {{"backlash_mL", "mL", "play as volume", 0.0, 0.0, 3.0, 0.3},
         {"initial_slack_fraction", "", "part of the play that the first inflation crosses", 0.5, 0.0, 1.0,
          0.5}}};
    return list;
  }
  void apply(std::span<const double> values, const Context&, rig::RigModel& model) const override {
    const double play_mL = values[0];
    if (play_mL == 0.0) return;
    const double ahead_mL = values[1] * play_mL;
    model.drive.emplace_back([=](rig::DriveTrace& trace, const rig::RunPlace&) {
      double piston_mL = trace.volume_mL.front();
      for (double& volume : trace.volume_mL) {
        piston_mL = std::clamp(piston_mL, volume - ahead_mL, volume + play_mL - ahead_mL);
        volume = piston_mL;
      }
      trace.differentiate();
    });
  }
};

}  // namespace

const Effect& backlash_effect() {
  static const Backlash effect;
  return effect;
}

}  // namespace diastole
