// More resistance to fast flow than entry, exit and wall friction of a plain hose.

#include "estimator/effects/effect.hpp"

namespace diastole {

Effect hose_loss_excess_effect() {
  return {{
      .id = "hose-loss-excess",
      .title = "excess loss of the hose",
      .port = Port::drive,
      .equations = "K rho v |v| / 2 with K larger by extra_K, in the same shares at both ends.",
      .source = "Borda-Carnot; bends, couplings, valves.",
      .looks_like = "The pump's pressure is higher where the flow is fast, in phase with it.",
      .revealed_by = "A sensor at the pump and strokes of different peak flow.",
      .conflicts = {"hose-inertance-excess"},
      .synergies = {"hose-compliance"},
      .changes = "hose",
      .parameters = {{"extra_K", "", "loss coefficient added", 0.0, 0.0, 200.0, 10.0}},
      .apply = [](EffectValues values, const EffectContext&,
                  rig::RigModel& model) { model.hose.loss_coefficient += values[0]; },
  }};
}

}  // namespace diastole
