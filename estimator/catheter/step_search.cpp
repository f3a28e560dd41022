#include "estimator/catheter/step_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace diastole::signal {
namespace {

constexpr double level_s = 0.1;
constexpr double settling_s = 0.3;
constexpr double fast_s = 0.06;
constexpr double fitted_s = 0.6;
constexpr double least_jump_sds = 10;
constexpr double onset_part = 0.1;

struct Level {
  double mean = 0;
  double sd = 0;
};

Level level_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  Level level;
  for (const double value : values)
    level.mean += value / n;
  for (const double value : values)
    level.sd += (value - level.mean) * (value - level.mean) / (n - 1);
  level.sd = std::sqrt(level.sd);
  return level;
}

struct Lengths {
  size_t level, settling, fast, fitted;
  explicit Lengths(double spacing_s)
      : level(rows(level_s, spacing_s)),
        settling(rows(settling_s, spacing_s)),
        fast(rows(fast_s, spacing_s)),
        fitted(rows(fitted_s, spacing_s)) {}
  static size_t rows(double length_s, double spacing_s) {
    return std::max<size_t>(3, static_cast<size_t>(std::lround(length_s / spacing_s)));
  }
};

}  // namespace

StepSearch find_steps(std::span<const double> pressure_kPa, double spacing_s) {
  const Lengths rows(spacing_s);
  StepSearch search;
  double largest_kPa = 0, largest_s = 0;
  size_t i = rows.level;
  while (i + rows.settling + rows.level <= pressure_kPa.size()) {
    const double change_kPa = std::abs(pressure_kPa[i + rows.fast] - pressure_kPa[i]);
    if (change_kPa > largest_kPa) {
      largest_kPa = change_kPa;
      largest_s = spacing_s * static_cast<double>(i);
    }
    const Level before = level_of(pressure_kPa.subspan(i - rows.level, rows.level));
    const Level after = level_of(pressure_kPa.subspan(i + rows.settling, rows.level));
    const double jump_kPa = after.mean - before.mean;
    const bool quiet = std::abs(jump_kPa) > least_jump_sds * std::max(before.sd, after.sd);
    const bool fast = std::abs(pressure_kPa[i + rows.fast] - before.mean) > 0.5 * std::abs(jump_kPa);
    if (!quiet || !fast) {  // also where a sample is missing
      ++i;
      continue;
    }
    size_t onset = i;
    while (std::abs(pressure_kPa[onset] - before.mean) < onset_part * std::abs(jump_kPa))
      ++onset;
    if (!search.steps.empty()) {
      search.steps.back().last = std::min(search.steps.back().last, onset - rows.level / 2);
    }
    search.steps.push_back({onset, i - rows.level, std::min(onset + rows.fitted, pressure_kPa.size()),
                            before.mean, after.mean, before.sd});
    i = onset + rows.settling + rows.level;
  }
  search.nearest =
      fmt::format("the largest change within 60 ms is {:.3f} kPa, at {:.2f} s", largest_kPa, largest_s);
  return search;
}

}  // namespace diastole::signal
