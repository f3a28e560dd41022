#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "estimator/parallel/parallel_for.hpp"
#include "estimator/rig_fit/rig_fit.hpp"

namespace diastole::rig {
namespace {

double sample_rate_Hz(const SessionRun& run) {
  return static_cast<double>(run.sample_s.size() - 1) / (run.sample_s.back() - run.sample_s.front());
}

constexpr size_t groups = 3;
constexpr size_t ramp_group = 2;
constexpr double ramp_mL = 1.0;  ///< by which a cycle ends elsewhere than it began, to be a ramp

double volume_at(const SessionRun& run, size_t row) {
  return run.drive.motion.at(run.sample_s[row]).volume_mL;
}

/// Every second cycle is varied at a time; ramps, whose variation stays, by themselves.
size_t group_of(const SessionRun& run, const std::vector<CycleRows>& cycles, size_t c) {
  const bool ramp = std::abs(volume_at(run, cycles[c].last - 1) - volume_at(run, cycles[c].first)) > ramp_mL;
  return ramp ? ramp_group : c % 2;
}

/// A ramp that went too far by `part`: what is above its start by now stays too far.
struct Overshoot {
  double from_mL = 0.0;
  double gone_mL = 0.0;

  [[nodiscard]] double at(double volume_mL) const {
    return gone_mL * std::clamp((volume_mL - from_mL) / gone_mL, 0.0, 1.0);
  }
};

/// The motion with the strokes of a group's cycles larger by `part`, in turn smaller, so that nothing piles up where the
/// rig remembers.
Motion varied(const SessionRun& run, size_t group, double part) {
  const Motion& motion = run.drive.motion;
  std::vector<Stroke> strokes = motion.strokes();
  const std::vector<CycleRows> cycles = cycles_of(run);
  std::vector<Overshoot> overshot;
  size_t stroke = 0;
  const auto shift = [&](double volume_mL, double own_part, double least_mL) {
    double shifted = volume_mL + own_part * (volume_mL - least_mL);
    for (const Overshoot& ramp : overshot)
      shifted += part * ramp.at(volume_mL);
    return shifted;
  };
  const auto shift_until = [&](double time_s, double own_part, double least_mL) {
    for (; stroke < strokes.size(); ++stroke) {
      Stroke& at = strokes[stroke];
      if (0.5 * (at.start_s + at.end_s) >= time_s) return;
      at.from_mL = shift(at.from_mL, own_part, least_mL);
      at.to_mL = shift(at.to_mL, own_part, least_mL);
    }
  };
  for (size_t c = 0; c < cycles.size(); ++c) {
    const double start_s = run.sample_s[cycles[c].first];
    const double end_s = run.sample_s[cycles[c].last - 1] + 1.0 / sample_rate_Hz(run);
    shift_until(start_s, 0.0, 0.0);
    const double least_mL = motion.at(start_s).volume_mL;
    double own_part = 0.0;
    if (group_of(run, cycles, c) == group) own_part = group != ramp_group && c / 2 % 2 == 1 ? -part : part;
    shift_until(end_s, own_part, least_mL);
    if (own_part != 0.0 && group == ramp_group)
      overshot.push_back({least_mL, motion.at(end_s).volume_mL - least_mL});
  }
  shift_until(std::numeric_limits<double>::infinity(), 0.0, 0.0);
  return {std::move(strokes), motion.rest_mL(), motion.spread_s()};
}

}  // namespace

void RigProblem::shrink_cycle_variations(size_t run, Eigen::Ref<Eigen::VectorXd> residuals) const {
  for (const CycleVariation& variation : variations_) {
    if (variation.run != run) continue;
    double along = 0.0;
    Eigen::Index at = 0;
    for (const CycleRows& rows : variation.rows) {
      const auto count = static_cast<Eigen::Index>(rows.last - rows.first);
      along += variation.direction.segment(at, count).dot(
          residuals.segment(static_cast<Eigen::Index>(rows.first), count));
      at += count;
    }
    at = 0;
    for (const CycleRows& rows : variation.rows) {
      const auto count = static_cast<Eigen::Index>(rows.last - rows.first);
      residuals.segment(static_cast<Eigen::Index>(rows.first), count) -=
          variation.shrinkage * along * variation.direction.segment(at, count);
      at += count;
    }
  }
}

std::vector<std::map<Channel, std::vector<double>>> RigProblem::variation_shapes(const KnownModel& of,
                                                                                 size_t group) const {
  constexpr double small = 0.01;
  const RigModel plain = model(of);
  std::vector<std::map<Channel, std::vector<double>>> shapes(session_.runs.size());
  parallel_for(session_.runs.size(), options_.threads, [&](size_t r) {
    const SessionRun& run = session_.runs[r];
    const Prediction a = observe(plain, plant(plain, r, Fidelity::fine), run.drive.place, run.sample_s);
    RunDrive other = run.drive;
    other.motion = varied(run, group, small);
    SimulationOptions simulation = options_.simulation;
    simulation.step_s = step_s(Fidelity::fine);
    Prediction b = observe(plain, simulate_plant(plain, other, simulation), other.place, run.sample_s);
    for (size_t k = 0; k < run.sample_s.size(); ++k) {
      b.cavity_kPa[k] = (b.cavity_kPa[k] - a.cavity_kPa[k]) / small;
      b.pump_kPa[k] = (b.pump_kPa[k] - a.pump_kPa[k]) / small;
    }
    for (const auto& [channel, noise] : noise_.channels)
      shapes[r][channel] = whitened(noise, channel == Channel::cavity ? b.cavity_kPa : b.pump_kPa);
  });
  return shapes;
}

void RigProblem::set_cycle_variations(const KnownModel& of) {
  constexpr double ringing = 0.4;  // of a cycle: how far into the next one its line rings on
  const std::array<std::vector<std::map<Channel, std::vector<double>>>, groups> shapes{
      variation_shapes(of, 0), variation_shapes(of, 1), variation_shapes(of, ramp_group)};
  for (size_t r = 0; r < session_.runs.size(); ++r) {
    const std::vector<CycleRows> cycles = cycles_of(session_.runs[r]);
    const auto lead = static_cast<size_t>(session_.runs[r].drive.motion.spread_s() / 2.0 *
                                          sample_rate_Hz(session_.runs[r]));
    for (size_t c = 0; c < cycles.size(); ++c) {
      const size_t length = cycles[c].last - cycles[c].first;
      const size_t first = cycles[c].first - std::min(cycles[c].first, lead);
      const size_t group = group_of(session_.runs[r], cycles, c);
      const size_t all = session_.runs[r].sample_s.size();
      const size_t last =
          group == ramp_group
              ? all
              : std::min(all, cycles[c].last + static_cast<size_t>(ringing * static_cast<double>(length)));
      CycleVariation variation{.run = r, .rows = {}, .direction = {}};
      std::vector<double> direction;
      for (const ResidualBlock& block : blocks_) {
        if (block.run != r || block.channel == "cavity_mL") continue;
        variation.rows.push_back({block.first + first, block.first + last});
        const auto& shape =
            shapes[group][r].at(block.channel == name_of(Channel::cavity) ? Channel::cavity : Channel::pump);
        direction.insert(direction.end(), shape.begin() + static_cast<std::ptrdiff_t>(first),
                         shape.begin() + static_cast<std::ptrdiff_t>(last));
      }
      variation.direction =
          Eigen::Map<const Eigen::VectorXd>(direction.data(), static_cast<Eigen::Index>(direction.size()));
      const double size = variation.direction.norm();
      if (size == 0.0) continue;
      variation.direction /= size;
      const double strength = noise_.cycle_sd * size;
      variation.shrinkage = 1.0 - 1.0 / std::sqrt(1.0 + strength * strength);
      variations_.push_back(std::move(variation));
    }
  }
}

}  // namespace diastole::rig
