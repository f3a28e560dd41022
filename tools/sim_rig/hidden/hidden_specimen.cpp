// Effects between the volume in the cavity and its pressure.

#include "tools/sim_rig/hidden/hidden_effects.hpp"

namespace diastole::sim_rig::hidden {

void air_bubble_cavity(Draw& draw) { draw.plant.flaws.cavity.gas_mL = draw.within("volume_mL", 8.0, 40.0); }

void cannula_leak_cavity(Draw& draw) {
  draw.plant.flaws.cavity.leak_mL_s_kPa = draw.within("leak_mL_s_kPa", 0.05, 0.5);
}

void viscoelasticity(Draw& draw) {
  SpecimenFlaws& gel = draw.plant.flaws.specimen;
  gel.relaxing = {draw.within("g_fast", 0.02, 0.1), draw.within("g_middle", 0.02, 0.08),
                  draw.within("g_slow", 0.02, 0.08)};
  gel.relaxing_s = {draw.within("tau_fast_s", 0.06, 0.2), draw.within("tau_middle_s", 0.6, 1.6),
                    draw.within("tau_slow_s", 4.0, 15.0)};
}

void strain_stiffening(Draw& draw) { draw.plant.flaws.specimen.stiffening = draw.within("beta", 0.6, 2.5); }

void stress_softening(Draw& draw) {
  SpecimenFlaws& gel = draw.plant.flaws.specimen;
  gel.softening = draw.within("delta", 0.06, 0.25);
  gel.softening_cycles = draw.within("cycles", 1.0, 6.0);
  gel.softening_V0_mL = draw.within("V0_mL", 8.0, 20.0);
}

void temperature_drift(Draw& draw) {
  draw.plant.flaws.specimen.warming = draw.either_sign("fraction", 0.02, 0.08);
  draw.plant.flaws.specimen.warming_s = draw.within("tau_s", 20.0, 100.0);
}

void end_bond_slip(Draw& draw) {
  draw.plant.flaws.specimen.bond_left = 1 - draw.within("bond_lost", 0.3, 0.8);
}

void radius_error(Draw& draw) {
  draw.plant.flaws.specimen.inner_radius_part = draw.either_sign("fraction", 0.02, 0.08);
}

void chamber_back_pressure(Draw& draw) {
  constexpr double kPa_per_Pa = 1e-3;
  draw.plant.flaws.specimen.chamber_kPa_mL = kPa_per_Pa * draw.within("k_Pa_mL", 8.0, 50.0);
}

}  // namespace diastole::sim_rig::hidden
