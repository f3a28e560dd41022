// The specimen relaxes.

#include "estimator/effects/effect.hpp"
#include "estimator/rig/relaxation.hpp"

namespace diastole {

Effect viscoelasticity_effect() {
  return {{
      .id = "viscoelasticity",
      .title = "viscoelastic specimen",
      .port = Port::specimen,
      .equations = "p = p_e - sum g_i (p_e - h_i), h_i the history of p_e fading with tau_i: dh_i/dt = "
                   "dp_e/dt - h_i / tau_i. C1 is the instantaneous modulus.",
      .source = "Y. C. Fung, Biomechanics (1993): quasi-linear viscoelasticity with three exponentials.",
      .looks_like = "Pressures lead volumes; after a ramp they relax; stiffness grows with rate.",
      .revealed_by = "A hold after a quick ramp and the same stroke at several rates.",
      .conflicts = {"cannula-leak-cavity", "seal-leak-pump"},
      .parameters = {{"g_fast", "", "part that relaxes within tau_fast", 0.0, 0.0, 0.6, 0.08},
                     {"g_middle", "", "within tau_middle", 0.0, 0.0, 0.6, 0.03},
                     {"g_slow", "", "within tau_slow", 0.0, 0.0, 0.6, 0.04},
                     {"tau_fast_s", "s", "", 0.1, 0.02, 0.4, 0.1, SearchScale::logarithmic},
                     {"tau_middle_s", "s", "", 1.0, 0.4, 2.5, 1.0, SearchScale::logarithmic},
                     {"tau_slow_s", "s", "", 6.0, 2.5, 60.0, 6.0, SearchScale::logarithmic}},
      .keeps_modulus = false,
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            rig::add_relaxation(model,
                                {{values[0], values[3]}, {values[1], values[4]}, {values[2], values[5]}});
          },
  }};
}

}  // namespace diastole
