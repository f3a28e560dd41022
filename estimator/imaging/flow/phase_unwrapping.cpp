#include "estimator/imaging/flow/phase_unwrapping.hpp"

#include <cmath>
#include <cstddef>
#include <limits>

#include "estimator/imaging/flow/moving_fluid.hpp"

namespace diastole::imaging {
namespace {

/// More turns than this in either direction would be a venc of a seventh of the peak.
constexpr int most_turns = 3;
constexpr int states = 2 * most_turns + 1;

}  // namespace

UnwrappedCycle unwrapped(const std::vector<double>& phase_rad, const std::vector<double>& gap) {
  const size_t count = phase_rad.size();
  const auto value = [&](size_t k, int state) { return phase_rad[k] + turn * (state - most_turns); };
  // A step over a gap of n phases counts as n equal ones.
  const auto cost = [&](size_t k, double from, double to) { return (to - from) * (to - from) / gap[k]; };
  UnwrappedCycle best;
  double least = std::numeric_limits<double>::infinity();
  // Dynamic programming for the turns of a first phase of none; all others are relative to it.
  std::vector<std::vector<double>> total(count, std::vector<double>(states, least));
  std::vector<std::vector<int>> before(count, std::vector<int>(states, 0));
  total[0][most_turns] = 0;
  for (size_t k = 1; k < count; ++k) {
    for (int state = 0; state < states; ++state) {
      for (int last = 0; last < states; ++last) {
        const double sum =
            total[k - 1][static_cast<size_t>(last)] + cost(k - 1, value(k - 1, last), value(k, state));
        if (sum >= total[k][static_cast<size_t>(state)]) continue;
        total[k][static_cast<size_t>(state)] = sum;
        before[k][static_cast<size_t>(state)] = last;
      }
    }
  }
  int end = 0;
  for (int state = 0; state < states; ++state) {
    const double sum = total[count - 1][static_cast<size_t>(state)] +
                       cost(count - 1, value(count - 1, state), value(0, most_turns));
    if (sum >= least) continue;
    least = sum;
    end = state;
  }
  best.turns.assign(count, 0);
  for (size_t k = count; k-- > 0;) {
    best.turns[k] = end - most_turns;
    end = before[k][static_cast<size_t>(end)];
  }
  double mean = 0;
  for (size_t k = 0; k < count; ++k)
    mean += (phase_rad[k] + turn * best.turns[k]) / static_cast<double>(count);
  const int shift = static_cast<int>(std::lround(mean / turn));
  for (size_t k = 0; k < count; ++k) {
    best.turns[k] -= shift;
    best.phase_rad.push_back(phase_rad[k] + turn * best.turns[k]);
  }
  for (size_t k = 0; k < count; ++k)
    best.largest_step_rad = std::max(best.largest_step_rad,
                                     std::abs(best.phase_rad[(k + 1) % count] - best.phase_rad[k]) / gap[k]);
  return best;
}

}  // namespace diastole::imaging
