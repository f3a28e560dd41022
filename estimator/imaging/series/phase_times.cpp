#include "estimator/imaging/series/phase_times.hpp"
#include "protocol/signal/median.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::imaging {
namespace {

constexpr double same_phase = 0.25;      // of a step
constexpr double whole_tolerance = 0.1;  // of a step
constexpr double most_missing = 16.0;    // a longer gap is a pause of the protocol, not missing images

/// Means of groups of times no further apart than `width_ms` from the group's first.
std::vector<double> grouped(const std::vector<double>& sorted, double width_ms) {
  std::vector<double> means;
  for (size_t first = 0; first < sorted.size();) {
    size_t end = first + 1;
    double sum = sorted[first];
    while (end < sorted.size() && sorted[end] - sorted[first] <= width_ms)
      sum += sorted[end++];
    means.push_back(sum / static_cast<double>(end - first));
    first = end;
  }
  return means;
}

void add_steps(const std::vector<double>& sorted, std::vector<double>& steps) {
  for (size_t i = 1; i < sorted.size(); ++i) {
    if (sorted[i] - sorted[i - 1] > trigger_resolution_ms) steps.push_back(sorted[i] - sorted[i - 1]);
  }
}

double median_step(const std::vector<double>& sorted) {
  std::vector<double> steps;
  add_steps(sorted, steps);
  return steps.empty() ? 0 : signal::median(std::move(steps));
}

}  // namespace

std::optional<size_t> PhaseTimes::index_of(double trigger_ms) const {
  if (times_ms.empty()) return std::nullopt;
  const auto nearest = std::min_element(times_ms.begin(), times_ms.end(), [&](double a, double b) {
    return std::abs(a - trigger_ms) < std::abs(b - trigger_ms);
  });
  const double step = median_step(times_ms);
  if (times_ms.size() > 1 && std::abs(*nearest - trigger_ms) > 0.5 * step) return std::nullopt;
  return static_cast<size_t>(nearest - times_ms.begin());
}

PhaseTimes phase_times(std::span<const std::vector<double>> trigger_ms_of_slices) {
  std::vector<double> all, of_slices;
  for (std::vector<double> of_slice : trigger_ms_of_slices) {
    std::sort(of_slice.begin(), of_slice.end());
    add_steps(of_slice, of_slices);
    all.insert(all.end(), of_slice.begin(), of_slice.end());
  }
  std::sort(all.begin(), all.end());
  const double usual =
      of_slices.empty() ? median_step(grouped(all, trigger_resolution_ms)) : signal::median(of_slices);
  const std::vector<double> means = grouped(all, std::max(trigger_resolution_ms, same_phase * usual));
  const double step = median_step(means);
  PhaseTimes phases;
  for (const double time : means) {
    if (!phases.times_ms.empty() && step > 0) {
      const double before = phases.times_ms.back();
      const double steps = (time - before) / step;
      const double whole = std::round(steps);
      if (whole >= 2 && whole <= most_missing && std::abs(steps - whole) <= whole_tolerance) {
        for (double i = 1; i < whole; ++i) {
          phases.times_ms.push_back(before + i * (time - before) / whole);
          phases.present.push_back(false);
        }
      }
    }
    phases.times_ms.push_back(time);
    phases.present.push_back(true);
  }
  return phases;
}

}  // namespace diastole::imaging
