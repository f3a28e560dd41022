#pragma once
// A waveform's points as the controller holds them: 16-bit rises between even phases (message WaveformPoints).
//
// Points that are evenly spaced are the controller's own. Others are put on an even grid: the curve through
// them is the controller's kind (firmware/core/uploaded/knot_cubic.hpp), a monotone cubic with slopes
//
//   m = (h1 s0 + h0 s1) / (h0 + h1), no steeper than 3 min(|s0|, |s1|), 0 where s0 s1 <= 0
//
// of the secants s0, s1 over the intervals h0, h1 on either side, and the grid is the one whose phases meet the
// points best, highest and lowest points first; phases that are multiples of 1/n are met exactly by a multiple of n.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "host/config/points_file.hpp"

namespace diastole {

struct EvenWaveform {
  std::vector<int16_t> rises;  ///< one a grid interval, around the cycle
  double off_grid = 0;         ///< the furthest that a point lies from a phase of the grid, part of the cycle

  /// The volumes at the grid's phases, 0 and 1 included, as parts of the stroke: what the controller plays.
  [[nodiscard]] std::vector<double> fractions() const;
};

/// As many points as even spacing needs, or none if the spacing is uneven (to 1e-6 of the cycle).
size_t even_points(const PointsFile& points);

/// The curve through the points at so many even phases, 0 included and 1 not: parts of the stroke.
std::vector<double> curve_at_even_phases(const PointsFile& points, size_t count);

/// Puts the points on their own even spacing, or on a grid of at most `room` phases. Precondition: room >= 2 and
/// even_points(points) <= room.
EvenWaveform on_even_phases(const PointsFile& points, size_t room);

}  // namespace diastole
