// Effects between the controller's steps and the volume in the cavity.

#include "tools/sim_rig/hidden/hidden_effects.hpp"

namespace diastole::sim_rig::hidden {

void stroke_gain(Draw& draw) { draw.plant.flaws.drive.gain = draw.either_sign("gain", 0.03, 0.1); }

void backlash(Draw& draw) { draw.plant.flaws.drive.backlash_mL = draw.within("backlash_mL", 0.1, 0.5); }

void missed_steps(Draw& draw) {
  draw.plant.flaws.drive.missed_in_cycle = draw.whole("cycle", 3, 6);
  draw.plant.flaws.drive.missed_mL = draw.within("lost_mL", 0.25, 1.0);
}

void seal_leak_pump(Draw& draw) {
  draw.plant.flaws.pump.leak_mL_s_kPa = draw.within("leak_mL_s_kPa", 0.02, 0.15);
}

void air_bubble_pump(Draw& draw) { draw.plant.flaws.pump.gas_mL = draw.within("volume_mL", 2.0, 20.0); }

void hose_compliance(Draw& draw) {
  HoseConfig& hose = draw.plant.hose;
  hose.wave_speed_m_s = draw.within("wave_speed_m_s", 30.0, 120.0);
  hose.segments = segments_for(hose);
}

void hose_inertance_excess(Draw& draw) {
  draw.plant.hose.inertia_factor = draw.within("inertance_factor", 1.1, 1.6);
}

void hose_loss_excess(Draw& draw) { draw.plant.minor_loss_K += draw.within("extra_K", 5.0, 40.0); }

void sticking_seal(Draw& draw) {
  draw.plant.flaws.drive.stick_mL = draw.within("stick_mL", 0.5, 1.5);
  draw.plant.flaws.drive.stick_share = 0.4;
}

void kinking_hose(Draw& draw) {
  draw.plant.flaws.cavity.kink_K = draw.within("extra_K", 60.0, 200.0);
  draw.plant.flaws.cavity.kink_above_mL = draw.within("above_mL", 12.0, 20.0);
}

}  // namespace diastole::sim_rig::hidden
