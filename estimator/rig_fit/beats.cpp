#include <algorithm>
#include <array>
#include <cmath>

#include "estimator/fe/parallel_for.hpp"
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

/// Strokes of a group's cycles larger by `part`, fading over the window in which accelerations are spread. What a ramp
/// has gone too far remains until the volume has come back.
void vary_cycles(const SessionRun& run, size_t group, double part, DriveTrace& trace) {
  const std::vector<CycleRows> cycles = cycles_of(run);
  const double fade_s = std::max(run.drive.motion.spread_s(), trace.step_s);
  for (size_t c = 0; c < cycles.size(); ++c) {
    if (group_of(run, cycles, c) != group) continue;
    const double start_s = run.sample_s[cycles[c].first];
    const double end_s = run.sample_s[cycles[c].last - 1] + 1.0 / sample_rate_Hz(run);
    const double least_mL = run.drive.motion.at(start_s).volume_mL;
    const double gone_mL = run.drive.motion.at(end_s).volume_mL - least_mL;
    for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
      const double begun = std::clamp((trace.time_s(k) - start_s) / fade_s + 0.5, 0.0, 1.0);
      const double ended = std::clamp((trace.time_s(k) - end_s) / fade_s + 0.5, 0.0, 1.0);
      const double larger = part * begun * (1.0 - ended);
      const double away_mL = trace.volume_mL[k] - least_mL;
      trace.volume_mL[k] += larger * away_mL;
      if (group == ramp_group)
        trace.volume_mL[k] += part * ended * gone_mL * std::clamp(away_mL / gone_mL, 0.0, 1.0);
      trace.flow_mL_per_s[k] *= 1.0 + larger;
      trace.acceleration_mL_per_s2[k] *= 1.0 + larger;
    }
  }
}

}  // namespace

void RigProblem::shrink_beats(size_t run, Eigen::Ref<Eigen::VectorXd> residuals) const {
  for (const Beat& beat : beats_) {
    if (beat.run != run) continue;
    double along = 0.0;
    Eigen::Index at = 0;
    for (const CycleRows& rows : beat.rows) {
      const auto count = static_cast<Eigen::Index>(rows.last - rows.first);
      along += beat.direction.segment(at, count).dot(
          residuals.segment(static_cast<Eigen::Index>(rows.first), count));
      at += count;
    }
    at = 0;
    for (const CycleRows& rows : beat.rows) {
      const auto count = static_cast<Eigen::Index>(rows.last - rows.first);
      residuals.segment(static_cast<Eigen::Index>(rows.first), count) -=
          beat.taken * along * beat.direction.segment(at, count);
      at += count;
    }
  }
}

std::vector<std::map<Channel, std::vector<double>>> RigProblem::beat_shapes(size_t group) const {
  constexpr double small = 0.01;
  RigModel plain = model({}, base_.values);
  RigModel varied = plain;
  varied.drive.emplace_back([&](DriveTrace& trace, const RunPlace& place) {
    for (const SessionRun& run : session_.runs)
      if (run.drive.place.name == place.name) vary_cycles(run, group, small, trace);
  });
  std::vector<std::map<Channel, std::vector<double>>> shapes(session_.runs.size());
  parallel_for(session_.runs.size(), options_.threads, [&](size_t r) {
    const SessionRun& run = session_.runs[r];
    const Prediction a = observe(plain, plant(plain, r, Look::fine), run.drive.place, run.sample_s);
    Prediction b = observe(varied, plant(varied, r, Look::fine), run.drive.place, run.sample_s);
    for (size_t k = 0; k < run.sample_s.size(); ++k) {
      b.cavity_kPa[k] = (b.cavity_kPa[k] - a.cavity_kPa[k]) / small;
      b.pump_kPa[k] = (b.pump_kPa[k] - a.pump_kPa[k]) / small;
    }
    for (const auto& [channel, noise] : noise_.channels)
      shapes[r][channel] = whitened(noise, channel == Channel::cavity ? b.cavity_kPa : b.pump_kPa);
  });
  return shapes;
}

void RigProblem::set_beats() {
  constexpr double ringing = 0.4;  // of a cycle: how far into the next one its line rings on
  const std::array<std::vector<std::map<Channel, std::vector<double>>>, groups> shapes{
      beat_shapes(0), beat_shapes(1), beat_shapes(ramp_group)};
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
      Beat beat{.run = r, .rows = {}, .direction = {}};
      std::vector<double> direction;
      for (const ResidualBlock& block : blocks_) {
        if (block.run != r || block.channel == "cavity_mL") continue;
        beat.rows.push_back({block.first + first, block.first + last});
        const auto& shape =
            shapes[group][r].at(block.channel == name_of(Channel::cavity) ? Channel::cavity : Channel::pump);
        direction.insert(direction.end(), shape.begin() + static_cast<std::ptrdiff_t>(first),
                         shape.begin() + static_cast<std::ptrdiff_t>(last));
      }
      beat.direction =
          Eigen::Map<const Eigen::VectorXd>(direction.data(), static_cast<Eigen::Index>(direction.size()));
      const double size = beat.direction.norm();
      if (size == 0.0) continue;
      beat.direction /= size;
      const double strength = noise_.beat_sd * size;
      beat.taken = 1.0 - 1.0 / std::sqrt(1.0 + strength * strength);
      beats_.push_back(std::move(beat));
    }
  }
}

}  // namespace diastole::rig
