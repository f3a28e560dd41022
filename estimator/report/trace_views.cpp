#include "estimator/report/trace_views.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace diastole::report {
namespace {

using explain::Trace;

constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();
constexpr double window_s = 8.0;             // of a spectrum: 0.125 Hz between its lines
constexpr double highest_frequency_Hz = 40;  // the transducer's low pass is at 30 Hz

size_t index_at(const std::vector<double>& time_s, double at_s) {
  return static_cast<size_t>(std::lower_bound(time_s.begin(), time_s.end(), at_s) - time_s.begin());
}

bool alike(double a, double b, double tolerance) { return std::abs(a - b) <= tolerance * std::max(a, b); }

/// Peak to peak of the augmented model, which has no noise.
double size_of(const Trace& trace, const TraceCycle& cycle) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (size_t i = cycle.first; i < cycle.last; ++i) {
    low = std::min(low, trace.after[i]);
    high = std::max(high, trace.after[i]);
  }
  return std::max(high - low, 0.0);
}

std::vector<std::vector<TraceCycle>> groups_of(const Trace& trace) {
  std::vector<std::vector<TraceCycle>> groups;
  for (const TraceCycle& cycle : cycles_of(trace)) {
    const bool continues = !groups.empty() && alike(groups.back().back().period_s, cycle.period_s, 0.02) &&
                           alike(size_of(trace, groups.back().back()), size_of(trace, cycle), 0.1);
    if (!continues) groups.emplace_back();
    groups.back().push_back(cycle);
  }
  return groups;
}

/// Mean of (measured - model)^2 over the cycles; negative if nothing was measured.
double mean_square(const Trace& trace, const std::vector<double>& model,
                   const std::vector<TraceCycle>& cycles) {
  double sum = 0.0;
  size_t count = 0;
  for (const TraceCycle& cycle : cycles) {
    for (size_t i = cycle.first; i < cycle.last; ++i) {
      const double off = trace.measured[i] - model[i];
      if (!std::isfinite(off)) continue;
      sum += off * off;
      ++count;
    }
  }
  return count == 0 ? -1.0 : sum / static_cast<double>(count);
}

/// Means of `values` by phase over the cycles.
std::vector<double> phase_means(const Trace& trace, const std::vector<double>& values,
                                const std::vector<TraceCycle>& cycles, size_t phases) {
  std::vector<double> sum(phases, 0.0), count(phases, 0.0);
  for (const TraceCycle& cycle : cycles) {
    for (size_t i = cycle.first; i < cycle.last; ++i) {
      if (!std::isfinite(values[i])) continue;
      const double phase = (trace.time_s[i] - cycle.start_s) / cycle.period_s;
      const size_t bin = std::min(phases - 1, static_cast<size_t>(phase * static_cast<double>(phases)));
      sum[bin] += values[i];
      count[bin] += 1.0;
    }
  }
  for (size_t bin = 0; bin < phases; ++bin)
    sum[bin] = count[bin] > 0 ? sum[bin] / count[bin] : nan_value;
  return sum;
}

/// Welch's method on values at an even rate; what is missing counts as zero.
Spectrum welch(std::vector<double> values, double rate_Hz) {
  double mean = 0.0;
  size_t finite = 0;
  for (const double value : values) {
    if (!std::isfinite(value)) continue;
    mean += value;
    ++finite;
  }
  if (finite < 16) return {};
  mean /= static_cast<double>(finite);
  for (double& value : values)
    value = std::isfinite(value) ? value - mean : 0.0;

  const size_t window = std::min(values.size(), static_cast<size_t>(window_s * rate_Hz));
  std::vector<double> hann(window);
  double power = 0.0;
  for (size_t i = 0; i < window; ++i) {
    hann[i] = 0.5 - 0.5 * std::cos(2 * std::numbers::pi * (static_cast<double>(i) + 0.5) /
                                   static_cast<double>(window));
    power += hann[i] * hann[i];
  }
  const double spacing_Hz = rate_Hz / static_cast<double>(window);
  const auto lines = static_cast<size_t>(std::min(highest_frequency_Hz, 0.5 * rate_Hz) / spacing_Hz);
  Spectrum spectrum;
  for (size_t line = 1; line <= lines; ++line) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(line) / static_cast<double>(window);
    double sum = 0.0;
    size_t windows = 0;
    for (size_t from = 0; from + window <= values.size(); from += std::max<size_t>(1, window / 2)) {
      // Goertzel: one multiplication a sample.
      double now = 0.0, before = 0.0;
      for (size_t i = 0; i < window; ++i) {
        const double next = hann[i] * values[from + i] + 2 * std::cos(turn) * now - before;
        before = now;
        now = next;
      }
      sum += now * now + before * before - 2 * std::cos(turn) * now * before;
      ++windows;
    }
    spectrum.frequency_Hz.push_back(static_cast<double>(line) * spacing_Hz);
    spectrum.density.push_back(std::sqrt(2 * sum / (static_cast<double>(windows) * power * rate_Hz)));
  }
  return spectrum;
}

double rate_of(const Trace& trace) {
  if (trace.time_s.size() < 2) return 1.0;
  return static_cast<double>(trace.time_s.size() - 1) / (trace.time_s.back() - trace.time_s.front());
}

}  // namespace

std::vector<TraceCycle> cycles_of(const Trace& trace) {
  std::vector<TraceCycle> cycles;
  if (trace.time_s.empty()) return cycles;
  const double end_s = trace.time_s.back();
  for (size_t k = 0; k < trace.trigger_s.size(); ++k) {
    const double start_s = trace.trigger_s[k];
    const bool last = k + 1 == trace.trigger_s.size();
    const double next_s = !last            ? trace.trigger_s[k + 1]
                          : cycles.empty() ? end_s
                                           : std::min(end_s, start_s + cycles.back().period_s);
    const TraceCycle cycle{index_at(trace.time_s, start_s), index_at(trace.time_s, next_s), start_s,
                           next_s - start_s};
    if (cycle.last > cycle.first) cycles.push_back(cycle);
  }
  if (cycles.empty()) {
    const double start_s = trace.time_s.front();
    cycles.push_back({0, trace.time_s.size(), start_s, std::max(end_s - start_s, 1e-9)});
  }
  return cycles;
}

double misfit_in_noise(const Trace& trace, const std::vector<double>& model) {
  const double square = mean_square(trace, model, {{0, trace.measured.size()}});
  return square < 0.0 ? nan_value : std::sqrt(square) / trace.noise_sd;
}

std::vector<std::vector<double>> residual_grid(const Trace& trace, const std::vector<double>& model,
                                               size_t phases) {
  std::vector<double> residual(model.size());
  for (size_t i = 0; i < model.size(); ++i)
    residual[i] = (trace.measured[i] - model[i]) / trace.noise_sd;
  std::vector<std::vector<double>> rows;
  for (const TraceCycle& cycle : cycles_of(trace))
    rows.push_back(phase_means(trace, residual, {cycle}, phases));
  return rows;
}

MeanCycle worst_mean_cycle(const Trace& trace, size_t phases) {
  const auto groups = groups_of(trace);
  if (groups.empty()) return {};
  const auto& worst = *std::ranges::max_element(groups, {}, [&](const std::vector<TraceCycle>& cycles) {
    return mean_square(trace, trace.before, cycles);
  });
  MeanCycle mean;
  mean.cycles = worst.size();
  mean.start_s = worst.front().start_s;
  for (size_t bin = 0; bin < phases; ++bin)
    mean.time_s.push_back((static_cast<double>(bin) + 0.5) / static_cast<double>(phases) *
                          worst.front().period_s);
  mean.measured = phase_means(trace, trace.measured, worst, phases);
  mean.before = phase_means(trace, trace.before, worst, phases);
  mean.after = phase_means(trace, trace.after, worst, phases);
  if (!trace.cavity_mL.empty()) mean.cavity_mL = phase_means(trace, trace.cavity_mL, worst, phases);
  return mean;
}

Spectrum residual_spectrum(const Trace& trace, const std::vector<double>& model) {
  std::vector<double> residual(model.size());
  for (size_t i = 0; i < model.size(); ++i)
    residual[i] = trace.measured[i] - model[i];
  return welch(std::move(residual), rate_of(trace));
}

Spectrum repeat_spectrum(const Trace& trace) {
  std::vector<double> differences;
  for (const auto& group : groups_of(trace)) {
    for (size_t k = 0; k + 1 < group.size(); ++k) {
      const size_t count = std::min(group[k].last - group[k].first, group[k + 1].last - group[k + 1].first);
      // The model takes off what the cycles differ by because samples fall on other phases.
      for (size_t i = 0; i < count; ++i) {
        const size_t a = group[k].first + i, b = group[k + 1].first + i;
        differences.push_back((trace.measured[b] - trace.after[b] - trace.measured[a] + trace.after[a]) /
                              std::numbers::sqrt2);
      }
    }
  }
  return welch(std::move(differences), rate_of(trace));
}

}  // namespace diastole::report
