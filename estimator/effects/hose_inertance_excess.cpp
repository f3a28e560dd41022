// The fluid between pump and cavity is heavier to move than a plain tube's.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect hose_inertance_excess_effect() {
  return {{
      .id = "hose-inertance-excess",
      .title = "excess inertance of the hose",
      .port = Port::drive,
      .equations = "rho L / A times the factor; the wall's compliance stays.",
      .source = "Constrictions, a longer or narrower hose: inertance sums L / A.",
      .looks_like = "The pump's pressure follows the acceleration with a larger factor; the cavity shows "
                    "nothing as long as the hose is stiff.",
      .revealed_by = "A sensor at the pump and fast strokes.",
      .conflicts = {"hose-loss-excess"},
      .synergies = {"hose-compliance", "air-bubble-pump"},
      .changes = "hose",
      .parameters = {{"inertance_factor", "", "over the hose of the description", 1.0, 0.5, 3.0, 1.2,
                      SearchScale::logarithmic}},
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.hose.inertance_factor *= values[0]; },
  }};
}

}  // namespace diastole
