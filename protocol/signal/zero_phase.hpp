#pragma once
// Filtering forward and backward (low_pass.hpp has the filter itself), each stretch of samples by itself: a stretch ends
// at NaN, which stays NaN, and at a break. A stretch is continued at both ends by its odd reflection, over three times
// the order and three samples more, as far as it has them.
//
// The whole signal is never held. The backward pass runs from the future into the past, and what it takes from far ahead
// dies away: the slowest pole decays with exp(-sin(pi / (2 order)) wc t), for the fourth order to 1e-20 in 20 cycles of
// the cutoff. So the backward pass begins anew again and again, 20 cycles ahead of the values that are given out, and
// the result is that of one pass but for rounding:
//
//   forward    ------------------------------------------>
//   backward           |<-- given out --<-- look-ahead ---

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "protocol/signal/low_pass.hpp"

namespace diastole::signal {

class ZeroPhaseFilter {
 public:
  using Take = std::function<void(double)>;

  /// `take` gets one value for each that is pushed, in order, some time later. The design's `passes` must be
  /// forward_and_backward.
  ZeroPhaseFilter(const LowPassDesign& design, Take take);

  /// NaN (a missing sample) ends a stretch and stays NaN.
  void push(double value);
  /// A stretch ends here: nothing is filtered across.
  void end_stretch();

 private:
  void begin_stretch();
  void filter_on(double value) { forward_.push_back(filter_.push(value)); }
  /// Gives out forward_[first, first + count), backward filtered from the end of forward_.
  void give_out(size_t first, size_t count);

  LowPassDesign design_;
  Take take_;
  size_t pad_;         ///< values that a stretch is continued by at both ends
  size_t look_ahead_;  ///< values
  LowPass filter_;
  std::vector<double> head_;     ///< the stretch's first values, until it is long enough to begin
  std::vector<double> tail_;     ///< its last values, newest last; for the continuation
  std::vector<double> forward_;  ///< forward filtered, not given out
  bool begun_ = false;
};

/// All at once; a stretch also ends before each row of `breaks` (ascending).
std::vector<double> filter_zero_phase(std::span<const double> values, std::span<const size_t> breaks,
                                      const LowPassDesign& design);

}  // namespace diastole::signal
