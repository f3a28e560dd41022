// The instrument's clock runs fast or slow.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect clock_skew_effect() {
  return {{
      .id = "clock-skew",
      .title = "skew of the clocks",
      .port = Port::clock,
      .equations = "y(t) shows what was there at t (1 + ppm 1e-6); t from the run's start.",
      .source = "Crystals differ by tens of ppm.",
      .looks_like = "A lag that grows through each run.",
      .revealed_by = "Long runs of fast cycles.",
      .conflicts = {"trigger-delay"},
      .parameters = {{"ppm", "ppm", "by which the instrument counts too few seconds", 0.0, -2000.0, 2000.0,
                      200.0}},
      .stage = Stage::sensors,
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.sample_skew -= 1e-6 * values[0]; },
  }};
}

}  // namespace diastole
