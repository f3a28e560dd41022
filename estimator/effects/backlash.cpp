// The screw has play: the piston follows the command only when the play is taken up.

#include <algorithm>
#include <cmath>
#include <vector>

#include "estimator/effects/effect.hpp"

namespace diastole {
namespace {

/// Below this play contacts close sooner: a small play goes over into none.
constexpr double least_play_mL = 0.02;

/// The play operator: the piston is moved along by the ends of a gap. It is followed in steps so short that a sample, the
/// mean around it, is smooth in when contact is made.
std::vector<double> play_operator(double backlash_mL, double slack_mL, const rig::DriveTrace& command) {
  constexpr size_t parts = 8;
  const size_t count = command.volume_mL.size();
  std::vector<double> piston_mL(count, 0.0);
  double at_mL = command.volume_mL.front();
  for (size_t k = 0; k + 1 < count; ++k) {
    const double rise = command.volume_mL[k + 1] - command.volume_mL[k];
    const double first = command.step_s * command.flow_mL_per_s[k];
    const double last = command.step_s * command.flow_mL_per_s[k + 1];
    for (size_t part = 0; part < parts; ++part) {
      const double s = (static_cast<double>(part) + 0.5) / static_cast<double>(parts);
      const double command_mL =
          command.volume_mL[k] +
          s * (first + s * (3.0 * rise - 2.0 * first - last + s * (first + last - 2.0 * rise)));
      at_mL = std::clamp(at_mL, command_mL - slack_mL, command_mL + backlash_mL - slack_mL);
      piston_mL[2 * part < parts ? k : k + 1] += at_mL / static_cast<double>(parts);
    }
  }
  piston_mL.front() += 0.5 * command.volume_mL.front();
  piston_mL.back() += 0.5 * at_mL;
  return piston_mL;
}

/// Weights of a normal distribution, from its middle on.
std::vector<double> normal_weights(double sd_steps) {
  constexpr double reach = 4.5;
  std::vector<double> weights;
  double sum = 0.0;
  for (double k = 0.0; k <= std::ceil(reach * sd_steps); ++k) {
    weights.push_back(std::exp(-0.5 * k * k / (sd_steps * sd_steps)));
    sum += k == 0.0 ? weights.back() : 2.0 * weights.back();
  }
  for (double& weight : weights)
    weight /= sum;
  return weights;
}

std::vector<double> smoothed(const std::vector<double>& values, const std::vector<double>& weights) {
  const size_t count = values.size();
  std::vector<double> out(count);
  for (size_t k = 0; k < count; ++k) {
    double sum = weights[0] * values[k];
    for (size_t j = 1; j < weights.size(); ++j)
      sum += weights[j] * (values[k - std::min(j, k)] + values[std::min(k + j, count - 1)]);
    out[k] = sum;
  }
  return out;
}

}  // namespace

Effect backlash_effect() {
  return {{
      .id = "backlash",
      .title = "backlash of the drive",
      .port = Port::drive,
      .equations = "Play operator: V_piston stays until it touches an end of the gap, V_commanded - s <= "
                   "V_piston <= V_commanded - s + backlash; each run begins with s = initial_slack_fraction "
                   "backlash ahead of the first inflation.",
      .source = "M. Brokate, J. Sprekels, Hysteresis and Phase Transitions (1996): the play operator.",
      .looks_like = "After each turn the pressure stands still for a moment, then jumps; the stroke is "
                    "smaller by the play, and a sensor at the pump sees a hammer blow.",
      .revealed_by =
          "Strokes of different size: the volume lost is the same in all; turns at rest and in motion.",
      .conflicts = {"stroke-gain", "missed-steps"},
      .parameters = {{"backlash_mL", "mL", "play between command and piston", 0.0, 0.0, 3.0, 0.2},
                     {"initial_slack_fraction", "",
                      "part of it that lies behind the piston when a run begins", 0.5, 0.0, 1.0, 0.5},
                     {"contact_s", "s", "in which a contact closes", 0.012, 0.004, 0.04, 0.012,
                      SearchScale::logarithmic}},
      .apply =
          [](EffectValues values, const EffectContext&, rig::RigModel& model) {
            const double backlash_mL = values[0];
            const double slack_mL = values[0] * (1.0 - values[1]);
            const double contact_s = -values[2] * std::expm1(-backlash_mL / least_play_mL);
            if (backlash_mL == 0.0) return;
            model.has_corners = true;
            model.drive.emplace_back([=](rig::DriveTrace& trace, const rig::RunPlace&) {
              trace.volume_mL = smoothed(play_operator(backlash_mL, slack_mL, trace),
                                         normal_weights(std::max(contact_s / trace.step_s, 1e-3)));
              trace.differentiate();
            });
          },
  }};
}

}  // namespace diastole
