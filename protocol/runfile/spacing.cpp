#include "protocol/runfile/spacing.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "protocol/signal/median.hpp"

namespace diastole::runfile {
namespace {

constexpr size_t rows_around = 8;
constexpr double hole_spacings_before_last = 1.1;  // the last row has none after it to tell late from shifted

/// Least phase of rows [first, last).
double least_phase_s(std::span<const double> time_s, size_t first, size_t last, double spacing_s) {
  double least_s = std::numeric_limits<double>::max();
  for (size_t i = first; i < last; ++i)
    least_s = std::min(least_s, time_s[i] - static_cast<double>(i) * spacing_s);
  return least_s;
}

}  // namespace

double median_spacing_s(std::span<const double> time_s) {
  std::vector<double> steps_s;
  for (size_t i = 1; i < time_s.size(); ++i)
    steps_s.push_back(time_s[i] - time_s[i - 1]);
  return steps_s.empty() ? 0.0 : signal::median(std::move(steps_s));
}

std::vector<size_t> holes_before(std::span<const double> time_s, double spacing_s) {
  std::vector<size_t> holes;
  size_t since = 0;  // the last hole
  for (size_t i = 1; i < time_s.size(); ++i) {
    if (time_s[i] - time_s[i - 1] <= spacing_s) continue;
    const size_t before = i - std::min(rows_around, i - since);
    const size_t after = std::min(i + rows_around, time_s.size());
    const double shift_s =
        least_phase_s(time_s, i, after, spacing_s) - least_phase_s(time_s, before, i, spacing_s);
    const double bound = i + 1 == time_s.size() ? hole_spacings_before_last : hole_spacings;
    if (shift_s < bound * spacing_s) continue;
    holes.push_back(i);
    since = i;
  }
  return holes;
}

Irregularity irregularity_of(std::span<const double> time_s, double spacing_s) {
  Irregularity irregularity;
  for (size_t i = 1; i < time_s.size(); ++i) {
    const double step_s = time_s[i] - time_s[i - 1];
    irregularity.longest_ms = std::max(irregularity.longest_ms, 1e3 * step_s);
    if (step_s > irregular_spacings * spacing_s) ++irregularity.steps;
  }
  return irregularity;
}

}  // namespace diastole::runfile
