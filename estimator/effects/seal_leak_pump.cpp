// Fluid passes the piston's seal.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect seal_leak_pump_effect() {
  return {{
      .id = "seal-leak-pump",
      .title = "leak past the piston's seal",
      .port = Port::drive,
      .equations = "q_hose = q_piston - G p_pump, both directions alike.",
      .source = "Laminar gap flow: proportional to pressure.",
      .looks_like = "The cavity loses volume while the pump's pressure is high and gains it while it is low; "
                    "the mean level wanders, steps relax.",
      .revealed_by = "A hold at volume: the pressure falls to zero; faster motions of the same stroke, whose "
                     "inertia pressure leaks too.",
      .conflicts = {"cannula-leak-cavity", "viscoelasticity"},
      .parameters = {{"leak_mL_s_kPa", "mL/(s kPa)", "conductance of the gap", 0.0, 0.0, 0.25, 0.05}},
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.pump_leak_mL_s_kPa += values[0]; },
  }};
}

}  // namespace diastole
