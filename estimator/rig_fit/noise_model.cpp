#include "estimator/rig_fit/noise_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>

#include "protocol/signal/median.hpp"

namespace diastole::rig {
namespace {

constexpr size_t order = 6;
constexpr double shortest_rest_s = 1.0;

/// Sums of products at each lag with their counts, NaN left out.
struct Autocovariance {
  std::array<double, order + 1> sum{};
  std::array<double, order + 1> count{};

  void add(const std::vector<double>& values, double scale) {
    for (size_t lag = 0; lag <= order; ++lag) {
      for (size_t k = lag; k < values.size(); ++k) {
        const double product = values[k] * values[k - lag];
        if (!std::isfinite(product)) continue;
        sum[lag] += scale * product;
        count[lag] += 1.0;
      }
    }
  }
  [[nodiscard]] double at(size_t lag) const { return count[lag] > 0.0 ? sum[lag] / count[lag] : 0.0; }
};

/// The rest before the first motion, its mean taken off.
std::vector<double> rest_of(const SessionRun& run, const std::vector<double>& values) {
  const auto& strokes = run.drive.motion.strokes();
  const double end_s =
      strokes.empty() ? run.sample_s.back() : strokes.front().start_s - run.drive.motion.spread_s();
  const size_t last = run.row_at(end_s);
  if (last == 0 || run.sample_s[last - 1] - run.sample_s.front() < shortest_rest_s) return {};
  std::vector<double> rest(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(last));
  double mean = 0.0;
  double count = 0.0;
  for (const double value : rest) {
    if (!std::isfinite(value)) continue;
    mean += value;
    count += 1.0;
  }
  for (double& value : rest)
    value -= mean / std::max(count, 1.0);
  return rest;
}

/// Pairs of successive cycles with equally many samples and equal motion.
struct CyclePair {
  CycleRows before, after;
};
std::vector<CyclePair> equal_pairs(const SessionRun& run) {
  std::vector<CyclePair> pairs;
  const std::vector<CycleRows> cycles = cycles_of(run);
  for (size_t k = 1; k + 1 < cycles.size(); ++k) {
    const CyclePair pair{cycles[k], cycles[k + 1]};
    if (pair.before.last - pair.before.first != pair.after.last - pair.after.first) continue;
    bool equal = true;
    for (const double part : {0.1, 0.3, 0.55, 0.8}) {
      const auto step = static_cast<size_t>(part * static_cast<double>(pair.before.last - pair.before.first));
      const double a = run.drive.motion.at(run.sample_s[pair.before.first + step]).volume_mL;
      const double b = run.drive.motion.at(run.sample_s[pair.after.first + step]).volume_mL;
      equal = equal && std::abs(a - b) < 0.02;
    }
    if (equal) pairs.push_back(pair);
  }
  return pairs;
}

/// The later cycle over the earlier one, less one, by least squares; their difference without that goes to `rest`.
double relative_change(const std::vector<double>& values, const CyclePair& pair, double zero,
                       std::vector<double>& rest) {
  double product = 0.0;
  double square = 0.0;
  const size_t count = pair.before.last - pair.before.first;
  for (size_t k = 0; k < count; ++k) {
    const double mean = 0.5 * (values[pair.before.first + k] + values[pair.after.first + k]) - zero;
    const double change = values[pair.after.first + k] - values[pair.before.first + k];
    if (!std::isfinite(mean) || !std::isfinite(change)) continue;
    product += mean * change;
    square += mean * mean;
  }
  const double gain = square > 0.0 ? product / square : 0.0;
  rest.clear();
  for (size_t k = 0; k < count; ++k) {
    const double mean = 0.5 * (values[pair.before.first + k] + values[pair.after.first + k]) - zero;
    rest.push_back(values[pair.after.first + k] - values[pair.before.first + k] - gain * mean);
  }
  return gain;
}

double zero_of(const SessionRun& run, const std::vector<double>& values) {
  double sum = 0.0;
  double count = 0.0;
  for (size_t k = 0; k < values.size() && run.sample_s[k] < run.sample_s.front() + shortest_rest_s; ++k) {
    if (!std::isfinite(values[k])) continue;
    sum += values[k];
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

/// Levinson's recursion.
ChannelNoise autoregression_of(const Autocovariance& covariance) {
  ChannelNoise noise;
  std::vector<double> a;
  double error = covariance.at(0);
  for (size_t k = 1; k <= order && error > 0.0; ++k) {
    double reflection = covariance.at(k);
    for (size_t j = 1; j < k; ++j)
      reflection -= a[j - 1] * covariance.at(k - j);
    reflection = std::clamp(reflection / error, -0.98, 0.98);
    std::vector<double> next(a);
    for (size_t j = 1; j < k; ++j)
      next[j - 1] -= reflection * a[k - j - 1];
    next.push_back(reflection);
    a = next;
    error *= 1.0 - reflection * reflection;
  }
  noise.sd_kPa = std::sqrt(covariance.at(0));
  noise.innovation_kPa = std::sqrt(error);
  noise.autoregression = a;
  noise.samples = covariance.count[0];
  return noise;
}

/// Mean squares of a series and of its second differences (over 6, so that white noise has two equal ones).
struct Roughness {
  double square = 0.0;
  double second_difference = 0.0;
  double count = 0.0;

  void add(const std::vector<double>& values) {
    for (size_t k = 2; k < values.size(); ++k) {
      const double second = values[k] - 2.0 * values[k - 1] + values[k - 2];
      if (!std::isfinite(second)) continue;
      square += values[k] * values[k];
      second_difference += second * second / 6.0;
      count += 1.0;
    }
  }
  /// Of slow over fast: what transients and drift raise, and a louder noise of the same colour does not.
  [[nodiscard]] double slowness() const { return second_difference > 0.0 ? square / second_difference : 0.0; }
};

ChannelNoise channel_noise(const Session& session, Channel channel) {
  constexpr double enough = 300.0;         // samples at rest that show the noise's colour
  constexpr double not_noise_alone = 2.0;  // slowness of cycles' difference over that at rest
  Autocovariance covariance;
  Roughness whole, still;
  std::vector<double> series;
  for (const SessionRun& run : session.runs) {
    const auto found = run.pressure_kPa.find(channel);
    if (found == run.pressure_kPa.end()) continue;
    series = rest_of(run, found->second);
    covariance.add(series, 1.0);
    still.add(series);
    whole.add(found->second);
  }
  for (const SessionRun& run : session.runs) {
    const auto found = run.pressure_kPa.find(channel);
    if (found == run.pressure_kPa.end() || channel != Channel::cavity) continue;
    for (const CyclePair& pair : equal_pairs(run)) {
      relative_change(found->second, pair, zero_of(run, found->second), series);
      Roughness differing;
      differing.add(series);
      if (still.count < enough || differing.slowness() < not_noise_alone * still.slowness())
        covariance.add(series, 0.5);
    }
  }
  if (covariance.count[0] > 100.0) return autoregression_of(covariance);
  const double sd = whole.count > 0.0 ? std::sqrt(whole.second_difference / whole.count) : 0.0;
  return {sd, sd, {}, std::max(whole.count, 1.0)};
}

/// The pressure at which a cycle starts: its stroke's least volume.
double start_of(const std::vector<double>& values, const CyclePair& pair) {
  constexpr size_t samples = 5;
  double sum = 0.0;
  double count = 0.0;
  for (const CycleRows& rows : {pair.before, pair.after}) {
    for (size_t k = rows.first; k < std::min(rows.first + samples, rows.last); ++k) {
      if (!std::isfinite(values[k])) continue;
      sum += values[k];
      count += 1.0;
    }
  }
  return count > 0.0 ? sum / count : 0.0;
}

/// Relative change from a cycle to the next, squared, and the part of it that noise makes.
struct CycleChange {
  double square = 0.0;
  double noise = 0.0;
};

/// s in E[square] = 2 s^2 + noise by weighted squares, single outliers cut.
double common_cycle_sd(const std::vector<CycleChange>& changes) {
  constexpr double cut = 9.0;
  constexpr size_t rounds = 30;
  std::vector<double> sizes;
  for (const CycleChange& change : changes)
    sizes.push_back(std::sqrt(change.square));
  double variance = 0.5 * std::pow(signal::deviation_of_normal(std::move(sizes)), 2);
  for (size_t round = 0; round < rounds; ++round) {
    double sum = 0.0;
    double weight = 0.0;
    for (const CycleChange& change : changes) {
      const double expected = 2.0 * variance + change.noise;
      sum += 0.5 * (std::min(change.square, cut * expected) - change.noise) / (expected * expected);
      weight += 1.0 / (expected * expected);
    }
    variance = std::max(sum / weight, 1e-8);
  }
  return std::sqrt(variance);
}

/// From successive cycles' gains: twice the variance, and what noise makes of it.
double cycle_sd(const Session& session, const NoiseModel& noise) {
  std::vector<CycleChange> changes;
  std::vector<double> rest;
  const ChannelNoise& channel = noise.channels.at(Channel::cavity);
  double correlation = 1.0;  // of a mean over many samples, to that of independent ones
  for (const double a : channel.autoregression)
    correlation -= a;
  const double level = channel.innovation_kPa / std::max(correlation, 0.05);
  for (const SessionRun& run : session.runs) {
    const auto& values = run.pressure_kPa.at(Channel::cavity);
    for (const CyclePair& pair : equal_pairs(run)) {
      const double zero = start_of(values, pair);
      const double gain = relative_change(values, pair, zero, rest);
      double square = 0.0;
      for (size_t k = pair.before.first; k < pair.before.last; ++k)
        if (std::isfinite(values[k])) square += (values[k] - zero) * (values[k] - zero);
      changes.push_back({gain * gain, 2.0 * level * level / square});
    }
  }
  if (changes.size() < 4) return 0.003;  // none repeat: the middle of what pumps do
  return common_cycle_sd(changes);
}

}  // namespace

std::vector<CycleRows> cycles_of(const SessionRun& run) {
  std::vector<CycleRows> cycles;
  const auto& triggers = run.drive.place.trigger_s;
  for (size_t k = 0; k < triggers.size(); ++k) {
    double end_s = run.sample_s.back() + 1.0;
    if (k + 1 < triggers.size()) end_s = triggers[k + 1];
    for (const runfile::Segment& segment : run.segments)
      if (triggers[k] < segment.end_s() - 1e-6 && triggers[k] >= segment.start_s - 1e-6)
        end_s = std::min(end_s, triggers[k] + segment.period_s);
    const CycleRows rows{run.row_at(triggers[k]), run.row_at(end_s)};
    if (rows.last > rows.first) cycles.push_back(rows);
  }
  return cycles;
}

std::vector<double> whitened(const ChannelNoise& noise, const std::vector<double>& values) {
  const size_t depth = noise.autoregression.size();
  std::vector<double> white(values.size(), 0.0);
  for (size_t k = depth; k < values.size(); ++k) {
    double innovation = values[k];
    for (size_t j = 1; j <= depth; ++j)
      innovation -= noise.autoregression[j - 1] * values[k - j];
    if (std::isfinite(innovation)) white[k] = innovation / noise.innovation_kPa;
  }
  return white;
}

double spectral_sd(const ChannelNoise& noise, double frequency_Hz, double rate_Hz) {
  std::complex<double> response = 1.0;
  for (size_t j = 0; j < noise.autoregression.size(); ++j)
    response -= noise.autoregression[j] * std::polar(1.0, -2.0 * std::numbers::pi * frequency_Hz / rate_Hz *
                                                              static_cast<double>(j + 1));
  return noise.innovation_kPa / std::abs(response);
}

NoiseModel estimate_noise(const Session& session) {
  NoiseModel noise;
  for (const Channel channel : {Channel::cavity, Channel::pump}) {
    const auto has_it = [&](const SessionRun& run) { return run.pressure_kPa.contains(channel); };
    if (std::ranges::any_of(session.runs, has_it)) noise.channels[channel] = channel_noise(session, channel);
  }
  noise.cycle_sd = cycle_sd(session, noise);
  return noise;
}

}  // namespace diastole::rig
