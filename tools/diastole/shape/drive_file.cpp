#include "tools/diastole/shape/drive_file.hpp"

#include <fmt/format.h>

#include "estimator/shaping/gated_run.hpp"

namespace diastole::shaping {

std::string points_text(const PlannedCycle& cycle, const std::string& target) {
  std::string text =
      fmt::format("# Drive of the pump by which the specimen follows {} (diastole shape).\n", target);
  text += fmt::format("# stroke_mL {:.6f}, offset_mL {:.6f}, period_s {:.6f}\n", cycle.stroke_mL,
                      cycle.offset_mL, cycle.period_s);
  text += lead_line(cycle.lead_s) + "phase,fraction\n";
  const auto intervals = static_cast<double>(cycle.fraction.size() - 1);
  for (size_t j = 0; j < cycle.fraction.size(); ++j)
    text += fmt::format("{:.9f},{:.9f}\n", static_cast<double>(j) / intervals, cycle.fraction[j]);
  return text;
}

std::string experiment_text(const PlannedCycle& cycle, const CyclePlan& plan,
                            const std::string& points_file) {
  std::string text = fmt::format(
      "# Written by diastole shape: the trigger comes where the wanted curve begins.\n"
      "format = \"diastole-experiment\"\nversion = 1\nsample_rate_Hz = 300\ngate_every = 1\nrest_s = {:g}\n",
      plan.rest_s);
  if (cycle.trigger_delay_ms > 0.0)
    text += fmt::format("trigger_delay_ms = {:.3f}\n", cycle.trigger_delay_ms);
  return text + fmt::format(
                    "\n[[segment]]\nwaveform = \"uploaded\"\npoints = \"{}\"\nstroke_mL = {:.6f}\n"
                    "offset_mL = {:.6f}\nperiod_s = {:.6f}\ncycles = {}\n",
                    points_file, cycle.stroke_mL, cycle.offset_mL, cycle.period_s, plan.cycles);
}

}  // namespace diastole::shaping
