#pragma once

#include <span>
#include <vector>

#include "protocol/signal/zero_phase.hpp"

namespace diastole::signal {

/// All at once; a stretch also ends before each row of `breaks` (ascending).
inline std::vector<double> filter_zero_phase(std::span<const double> values, std::span<const size_t> breaks,
                                             const LowPassDesign& design) {
  std::vector<double> filtered;
  ZeroPhaseFilter filter(design, [&](double value) { filtered.push_back(value); });
  auto next_break = breaks.begin();
  for (size_t row = 0; row < values.size(); ++row) {
    if (next_break != breaks.end() && *next_break == row) {
      filter.end_stretch();
      ++next_break;
    }
    filter.push(values[row]);
  }
  filter.end_stretch();
  return filtered;
}

}  // namespace diastole::signal
