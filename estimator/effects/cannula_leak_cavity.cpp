// Fluid leaves the cavity beside the cannula.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect cannula_leak_cavity_effect() {
  return {{
      .id = "cannula-leak-cavity",
      .title = "leak at the cavity",
      .port = Port::specimen,
      .equations = "V_cavity' = q_hose - G p_cavity.",
      .source = "Laminar gap flow: proportional to pressure.",
      .looks_like = "The pressure falls during a hold, the least volume sinks from cycle to cycle to a new "
                    "balance; the gated volume follows.",
      .revealed_by =
          "A hold at volume, and a rest after it: the pressure ends below zero by the volume lost.",
      .conflicts = {"seal-leak-pump", "viscoelasticity"},
      .parameters = {{"leak_mL_s_kPa", "mL/(s kPa)", "conductance of the gap", 0.0, 0.0, 2.0, 0.1}},
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double conductance = values[0];
            if (conductance == 0.0) return;
            model.cavity_leaks.emplace_back([conductance](const rig::RunPlace&) {
              return [conductance](double pressure_kPa, double) { return conductance * pressure_kPa; };
            });
          },
  }};
}

}  // namespace diastole
