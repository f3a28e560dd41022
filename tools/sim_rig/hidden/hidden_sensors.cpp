// Effects of transducers and clocks.

#include "tools/sim_rig/hidden/hidden_effects.hpp"

namespace diastole::sim_rig::hidden {
namespace {

constexpr double kPa_per_Pa = 1e-3;

}  // namespace

void sensor_gain(Draw& draw) { draw.plant.flaws.sensors.gain = draw.either_sign("gain", 0.04, 0.15); }

void sensor_offset(Draw& draw) {
  draw.plant.flaws.sensors.step_in_cycle = draw.whole("cycle", 3, 6);
  draw.plant.flaws.sensors.step_kPa = kPa_per_Pa * draw.either_sign("step_Pa", 100.0, 600.0);
}

void sensor_drift(Draw& draw) {
  draw.plant.flaws.sensors.drift_kPa_s = kPa_per_Pa * draw.either_sign("rate_Pa_s", 4.0, 20.0);
}

void catheter_resonance(Draw& draw) {
  draw.plant.cavity.f0_Hz = draw.within("f0_Hz", 6.0, 20.0);
  draw.plant.cavity.zeta = draw.within("zeta", 0.15, 0.5);
}

void trigger_delay(Draw& draw) { draw.plant.flaws.sensors.delay_s = draw.within("delay_s", 0.008, 0.05); }

/// Readings fall behind, as by a clock that counts too many seconds: ppm of `diastole explain` is negative.
void clock_skew(Draw& draw) {
  draw.plant.flaws.sensors.lag_ppm = draw.within("ppm", 400.0, 2000.0);
  draw.drawn["ppm"] = -draw.plant.flaws.sensors.lag_ppm;
}

void mains_hum(Draw& draw) {
  draw.plant.flaws.sensors.hum_Hz = draw.within("hum_Hz", 3.0, 20.0);
  draw.plant.flaws.sensors.hum_kPa = draw.within("hum_kPa", 0.05, 0.3);
}

}  // namespace diastole::sim_rig::hidden
