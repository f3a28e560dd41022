#pragma once
// Samples that stand at the end of an instrument's range: a run of equal values at the signal's extreme, entered and left in
// steps that a signal coming to rest does not make. One value at a time, without storage, so that the daemon counts while it
// records and `inspect` counts the same afterwards.

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>

namespace diastole::signal {

struct Saturated {
  double value = 0;
  int64_t samples = 0;
  int64_t runs = 0;
};

class SaturationWatch {
 public:
  /// Some equal samples happen at the extreme of a long recording's noise, where it is a few codes; six hardly ever do.
  static constexpr int64_t kLeastRun = 6;
  /// A signal at rest flickers between neighbouring codes; one that is cut off has been moving on.
  static constexpr double kLeastStep_codes = 4;
  /// ... and by this part of what the signal spans: values that are not codes have no smallest step.
  static constexpr double kLeastStep_part = 1e-3;

  /// NaN: the sample is missing.
  void push(double value) {
    if (std::isnan(value)) {
      run_ = 0;
      last_ = value;
      return;
    }
    if (run_ > 0 && value == last_) {
      ++run_;
      return;
    }
    const double step = std::abs(value - last_);  // NaN after a gap: no step
    if (step > 0 && step < code_) code_ = step;
    if (run_ >= kLeastRun) end_run(step);
    run_ = 1;
    entered_by_ = step;
    last_ = value;
    if (value > most_.value) most_ = {value, 0, 0};
    if (value < least_.value) least_ = {value, 0, 0};
  }

  /// At the greatest and the least value, so far; a run that has not ended does not count.
  [[nodiscard]] const Saturated& most() const { return most_; }
  [[nodiscard]] const Saturated& least() const { return least_; }
  [[nodiscard]] int64_t samples() const { return most_.samples + least_.samples; }

 private:
  void end_run(double left_by) {
    const double enough = std::fmax(kLeastStep_codes * code_, kLeastStep_part * (most_.value - least_.value));
    if (!(entered_by_ >= enough && left_by >= enough)) return;
    for (Saturated* end : {&most_, &least_}) {
      if (last_ != end->value) continue;
      end->samples += run_;
      ++end->runs;
    }
  }

  static constexpr double kInfinite = std::numeric_limits<double>::infinity();
  Saturated most_{-kInfinite, 0, 0}, least_{kInfinite, 0, 0};
  double code_ = kInfinite;  ///< smallest step so far
  double last_ = std::numeric_limits<double>::quiet_NaN();
  double entered_by_ = 0;
  int64_t run_ = 0;  ///< equal values up to the last one
};

}  // namespace diastole::signal
