// The motor loses steps at single moments.

#include <cmath>
#include <numbers>
#include <vector>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

constexpr double reach = 8.0;  ///< of the loss, in sd: beyond, numbers see none of it

void apply(EffectValues values, const EffectContext& context, rig::RigModel& model) {
  const double lost_mL = values[0];
  const double stall_s = values[1];
  const std::vector<ChangePoint> moments(context.change_points.begin(), context.change_points.end());
  if (lost_mL == 0.0 || moments.empty()) return;
  // Behind the screw's own error. A screw that loses turns errs by another angle from then on; what is lost behind it (a nut, a rod)
  // leaves the angle, as in a recording of world 2 (docs/explain.md), whose pump's sensor shows it.
  model.has_corners = true;
  model.drive.emplace_back([=](rig::DriveTrace& trace, const rig::RunPlace& place) {
    for (const ChangePoint& moment : moments) {
      if (moment.run != place.name) continue;
      for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
        const double late = (trace.time_s(k) - moment.time_s) / stall_s;
        if (late < -reach) continue;
        trace.volume_mL[k] -= lost_mL * 0.5 * std::erfc(-late / std::numbers::sqrt2);
        if (late > reach) continue;
        const double speed = std::exp(-0.5 * late * late) / (stall_s * std::sqrt(2.0 * std::numbers::pi));
        trace.flow_mL_per_s[k] -= lost_mL * speed;
        trace.acceleration_mL_per_s2[k] += lost_mL * speed * late / stall_s;
      }
    }
  });
}

}  // namespace

Effect missed_steps_effect() {
  return {{
      .id = "missed-steps",
      .title = "missed steps",
      .port = Port::drive,
      .equations = "V_piston = V_commanded - lost_mL sum Phi((t - t_i) / stall_s) over the moments t_i, Phi "
                   "the normal distribution.",
      .source = "A stepper that falls out of step loses whole electrical cycles at once.",
      .looks_like = "From a moment on the pressure of all later phases is shifted, first visible where the "
                    "load was highest.",
      .revealed_by = "A homing after the run, which counts the steps.",
      .conflicts = {"cannula-leak-cavity"},
      .parameters = {{"lost_mL", "mL", "volume lost each time", 0.0, -3.0, 3.0, 0.25},
                     {"stall_s", "s", "sd of the loss in time", 0.02, 0.004, 0.06, 0.02,
                      SearchScale::logarithmic}},
      .change_points = ChangePoints::several,
      .apply = apply,
  }};
}

}  // namespace diastole
