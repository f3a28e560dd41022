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

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "protocol/signal/low_pass.hpp"

namespace diastole::signal {

class ZeroPhaseFilter {
 public:
  using Take = std::function<void(double)>;

  /// `take` gets one value for each that is pushed, in order, some time later. The design's `passes` must be
  /// forward_and_backward.
  ZeroPhaseFilter(const LowPassDesign& design, Take take)
      : design_(design),
        take_(std::move(take)),
        pad_(3 * static_cast<size_t>(design.order + 1)),
        look_ahead_(static_cast<size_t>(std::ceil(look_ahead_cycles * design.rate_Hz / design.cutoff_Hz))),
        filter_(design) {}

  /// NaN (a missing sample) ends a stretch and stays NaN.
  void push(double value) {
    if (std::isnan(value)) {
      end_stretch();
      take_(value);
      return;
    }
    if (begun_) {
      filter_on(value);
      tail_.push_back(value);
      if (tail_.size() > 2 * (pad_ + 1))
        tail_.erase(tail_.begin(), tail_.end() - static_cast<std::ptrdiff_t>(pad_ + 1));
    } else {
      head_.push_back(value);
      if (head_.size() > pad_) begin_stretch();
    }
    if (forward_.size() >= 2 * look_ahead_) {
      give_out(0, look_ahead_);
      forward_.erase(forward_.begin(), forward_.begin() + static_cast<std::ptrdiff_t>(look_ahead_));
    }
  }
  /// A stretch ends here: nothing is filtered across.
  void end_stretch() {
    if (!begun_ && head_.empty()) return;
    if (!begun_) begin_stretch();
    const size_t values = forward_.size();
    const size_t pad = std::min(pad_, tail_.size() - 1);
    for (size_t i = 1; i <= pad; ++i)
      filter_on(2 * tail_.back() - tail_[tail_.size() - 1 - i]);
    give_out(0, values);
    forward_.clear();
    tail_.clear();
    begun_ = false;
  }

 private:
  static constexpr double look_ahead_cycles = 20;  // of the cutoff

  void begin_stretch() {
    filter_ = LowPass(design_);
    for (size_t i = std::min(pad_, head_.size() - 1); i > 0; --i)
      (void)filter_.push(2 * head_.front() - head_[i]);
    for (const double value : head_)
      filter_on(value);
    tail_ = std::exchange(head_, {});
    begun_ = true;
  }
  void filter_on(double value) { forward_.push_back(filter_.push(value)); }
  /// Gives out forward_[first, first + count), backward filtered from the end of forward_.
  void give_out(size_t first, size_t count) {
    std::vector<double> backward(count);
    LowPass filter(design_);
    for (size_t i = forward_.size(); i > first; --i) {
      const double value = filter.push(forward_[i - 1]);
      if (i - 1 < first + count) backward[i - 1 - first] = value;
    }
    for (const double value : backward)
      take_(value);
  }

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

}  // namespace diastole::signal
