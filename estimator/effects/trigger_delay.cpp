// Samples carry times that are late or early by a constant.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect trigger_delay_effect() {
  return {{
      .id = "trigger-delay",
      .title = "delay of the samples",
      .port = Port::clock,
      .equations = "y(t) shows what was there at t - delay, in all pressure channels.",
      .source = "Start of acquisition against the controller's trigger.",
      .looks_like = "All pressures lag by the same time at every rate; residuals are proportional to the "
                    "pressures' slopes.",
      .revealed_by = "Waveforms at several rates: a catheter's lag comes with ringing, this one does not.",
      .conflicts = {"catheter-resonance", "clock-skew"},
      .parameters = {{"delay_s", "s", "of the samples", 0.0, -0.2, 0.2, 0.01}},
      .stage = Stage::sensors,
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.sample_delay_s += values[0]; },
  }};
}

}  // namespace diastole
