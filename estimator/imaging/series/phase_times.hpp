#pragma once
// Trigger times of a cine made to numbered phases: frame k of a study is image phase k, whether or not every slice has it.

#include <optional>
#include <span>
#include <vector>

namespace diastole::imaging {

/// No image is made in less, and headers give no more.
inline constexpr double trigger_resolution_ms = 0.5;

struct PhaseTimes {
  std::vector<double>
      times_ms;               ///< of phase 1, 2, ...; of a phase that no image has, in between its neighbours
  std::vector<bool> present;  ///< whether any image has it

  /// From 0; nothing if no phase lies within half a step.
  [[nodiscard]] std::optional<size_t> index_of(double trigger_ms) const;
};

/// From the trigger times of each slice's images, in any order and with repetitions. Times closer than a quarter of a slice's usual
/// step are one phase, their mean: scanners write the interval measured for each slice. A gap of a whole number of steps, to a
/// tenth, is phases that are missing.
PhaseTimes phase_times(std::span<const std::vector<double>> trigger_ms_of_slices);

}  // namespace diastole::imaging
