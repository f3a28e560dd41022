#pragma once
// When an uploaded waveform crosses the levels half way between microsteps, one crossing after the other. The
// waveform may rise and fall as often as it likes.
//
// With N levels to the stroke F, in the store's units, level k + 1/2 lies at y = (2k + 1) F / 2N. Taken twice
// and kept as whole + rest / N, levels follow from one another by exact additions. On its way through the points
// only integers are compared; within the interval found, the crossing is the root of a cubic (knot_cubic.hpp)
// between the last crossing, or the interval's beginning, and its end: Newton's method, held in the bracket by
// halving it, in units of 2^-42 of the interval. Steps are single precision, which IEEE 754 rounds alike
// everywhere; the residual is exact integer arithmetic, and a step after which nothing is looked at is below 2^20, so right to one.
//
// Where the curve turns less than 1/8 of a microstep behind a level it goes back unnoticed: without that, two
// opposite steps could come at any distance. What was let go is made good where the curve turns next and goes
// on beyond the level. The position is so the ideal one rounded to a microstep, to 5/8 of one.

#include <cstdint>

#include "firmware/core/arithmetic/fixed_point.hpp"
#include "firmware/core/uploaded/knot_cubic.hpp"
#include "firmware/core/uploaded/waveform_store.hpp"

namespace diastole::firmware {

class UploadedCrossings {
 public:
  struct Crossing {
    Q64 phase = 0;  ///< of the cycle
    bool rising = false;
  };

  UploadedCrossings() = default;
  /// `waveform` must outlive this. Precondition: 1 <= levels < 2^31.
  UploadedCrossings(const UploadedWaveform& waveform, std::uint32_t levels);

  /// Back to the beginning of the cycle.
  void restart();
  /// No level is crossed any more in this cycle; the volume is then the least.
  [[nodiscard]] bool at_end() const { return knot_ == intervals_; }
  /// The next crossing. Precondition: !at_end().
  Crossing take();

 private:
  /// whole + rest / levels
  struct Level {
    std::int32_t whole = 0;
    std::uint32_t rest = 0;
  };
  void raise_next();
  void lower_next();
  void begin_flank();
  void seek();
  [[nodiscard]] bool flank_reaches_next() const;
  [[nodiscard]] bool interval_reaches_next(std::int32_t end) const;
  [[nodiscard]] std::int64_t next_above_knot() const;

  const UploadedWaveform* waveform_ = nullptr;
  std::uint32_t levels_ = 1;
  Q64 level_fraction_ = 0;     ///< 1 / levels
  Q64 interval_fraction_ = 0;  ///< 1 / intervals
  Level half_;                 ///< the lowest level
  Level spacing_;
  std::int32_t surely_ = 0;  ///< a flank that goes on by more, twice, crosses the next level
  std::int32_t intervals_ = 0;

  std::int32_t knot_ = 0;       ///< the interval in which the next crossing lies begins at this point
  std::int32_t height_ = 0;     ///< there, twice
  std::int32_t flank_end_ = 0;  ///< the point up to which the curve goes the same way
  std::int32_t flank_height_ = 0;
  bool rising_ = true;
  Level next_;  ///< the next level on this flank, twice
  std::int64_t last_ =
      0;  ///< the last crossing of this flank, 2^-42 of the interval: below 0 in one before it
  std::int64_t pace_ = 0;     ///< from the crossing before it to that one; 0: none yet on this flank
  std::int64_t guess_ = 0;    ///< of the next one: the pace goes on changing as it did
  std::int32_t curved_ = -1;  ///< the interval that curve_ is of
  KnotCubic curve_;
};

}  // namespace diastole::firmware
