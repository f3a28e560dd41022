#pragma once
// How the rows of a stream are spaced: what is a hole, and what is only irregular.
//
// Row k of a stream was due at t0 + k / rate and taken a little later: lateness_k >= 0, at most one spacing,
// or the recorder would have declared row k missing. So two rows may lie nearly two spacings apart although
// nothing lies between them; the rows after a late one are on the grid again. Where a row is absent and not
// declared, all later rows stay one spacing late by their count:
//
//   on the grid    |   |   |   |   |   |
//   row 3 late     |   |   |      ||   |      irregular, nothing missing
//   row 3 absent   |   |   |       |   |   |  a hole before the fourth
//
// With phase_k = t_k - k * spacing, the least phase of the rows around a place is that of the row that came
// most in time. A hole lies before row i where the least phase of the eight rows from i on exceeds that of
// the up to eight rows before (since the last hole) by hole_spacings or more.

#include <cstddef>
#include <vector>

#include "protocol/runfile/series.hpp"

namespace diastole::runfile {

/// A whole spacing, less what jitter of the rows most in time may take off it.
inline constexpr double hole_spacings = 0.9;
/// A longer step between two rows is irregular.
inline constexpr double irregular_spacings = 1.6;
/// The first row after a moment, or the last before it, may be this far from it with nothing missing.
inline constexpr double reach_spacings = 2;

/// A row before `row` is absent that nothing declares.
struct Hole {
  size_t row = 0;
  double before_s = 0;  ///< time of the row before
  double after_s = 0;   ///< of `row`
};

struct Irregularity {
  size_t steps = 0;       ///< longer than irregular_spacings
  double longest_ms = 0;  ///< of all steps
};

struct Spacing {
  double median_s = 0;  ///< 0 for fewer than two rows
  double first_s = 0;   ///< time of the first row
  double last_s = 0;
  Irregularity irregularity;
  std::vector<Hole> holes;
};

/// Times must increase strictly. The median of more than 131,072 steps is that of as many of them at most, evenly spread.
Spacing spacing_of(const Series& time_s);

}  // namespace diastole::runfile
