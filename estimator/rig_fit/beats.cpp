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

/// Strokes larger by `part` in every second cycle, fading over the window in which accelerations are spread.
void vary_cycles(const SessionRun& run, size_t parity, double part, DriveTrace& trace) {
  const std::vector<CycleRows> cycles = cycles_of(run);
  const double fade_s = std::max(run.drive.motion.spread_s(), trace.step_s);
  for (size_t c = parity; c < cycles.size(); c += 2) {
    const double start_s = run.sample_s[cycles[c].first];
    const double end_s = run.sample_s[cycles[c].last - 1] + 1.0 / sample_rate_Hz(run);
    const double least_mL = run.drive.motion.at(start_s).volume_mL;
    for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
      const double within = std::min(trace.time_s(k) - start_s, end_s - trace.time_s(k)) / fade_s + 0.5;
      const double larger = part * std::clamp(within, 0.0, 1.0);
      trace.volume_mL[k] += larger * (trace.volume_mL[k] - least_mL);
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

std::vector<std::map<Channel, std::vector<double>>> RigProblem::beat_shapes(size_t parity) const {
  constexpr double small = 0.01;
  RigModel plain = model({}, base_.values);
  RigModel varied = plain;
  varied.drive.emplace_back([&](DriveTrace& trace, const RunPlace& place) {
    for (const SessionRun& run : session_.runs)
      if (run.drive.place.name == place.name) vary_cycles(run, parity, small, trace);
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
  const std::array shapes{beat_shapes(0), beat_shapes(1)};
  for (size_t r = 0; r < session_.runs.size(); ++r) {
    const std::vector<CycleRows> cycles = cycles_of(session_.runs[r]);
    const auto lead = static_cast<size_t>(session_.runs[r].drive.motion.spread_s() / 2.0 *
                                          sample_rate_Hz(session_.runs[r]));
    for (size_t c = 0; c < cycles.size(); ++c) {
      const size_t length = cycles[c].last - cycles[c].first;
      const size_t first = cycles[c].first - std::min(cycles[c].first, lead);
      const size_t last =
          std::min(session_.runs[r].sample_s.size(),
                   cycles[c].last + static_cast<size_t>(ringing * static_cast<double>(length)));
      Beat beat{.run = r, .rows = {}, .direction = {}};
      std::vector<double> direction;
      for (const ResidualBlock& block : blocks_) {
        if (block.run != r || block.channel == "cavity_mL") continue;
        beat.rows.push_back({block.first + first, block.first + last});
        const auto& shape =
            shapes[c % 2][r].at(block.channel == name_of(Channel::cavity) ? Channel::cavity : Channel::pump);
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
