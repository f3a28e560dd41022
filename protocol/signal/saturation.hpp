#pragma once
// Samples that stand at the end of an instrument's range: a run of equal values at the signal's extreme, entered and left in
// steps that a signal coming to rest does not make. The range's end cuts the step that meets it short: of the last two before
// the run and of the first two after it the longer one counts. A run that a gap or the recording's end cuts off has one side alone, by
// which it is judged. One value at a time, without storage, so that the daemon counts while it records and `inspect` counts the same
// afterwards.

#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <limits>
#include <utility>

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
  /// Seconds of a recording: a converter's noise of a tenth of a code would have shown another one.
  static constexpr int64_t kLeastStill = 1000;
  /// A signal at rest flickers between neighbouring codes; one that is cut off has been moving on.
  static constexpr double kLeastStep_codes = 4;
  /// ... and by this part of what the signal spans: values that are not codes have no smallest step.
  static constexpr double kLeastStep_part = 1e-3;

  /// NaN: the sample is missing.
  void push(double value) {
    const double step = std::abs(value - last_);  // NaN at a gap and after it: no step
    if (step > 0 && step < code_) code_ = step;
    if (left_.samples > 0) end_run(std::fmax(left_by_, step));
    if (std::isnan(value)) return break_off();
    ++values_;
    if (run_ > 0 && value == last_) {
      ++run_;
      return;
    }
    if (run_ >= kLeastRun) {
      left_ = {last_, run_, 1};
      left_by_ = step;
      left_entered_by_ = entered_by_;
    }
    entered_by_ = run_ == 0 ? kUnknown : std::fmax(step, run_ == 1 ? step_ : 0.0);
    step_ = run_ == 0 ? 0.0 : step;
    run_ = 1;
    last_ = value;
    if (value > most_.value) most_ = {value, 0, 0};
    if (value < least_.value) least_ = {value, 0, 0};
  }

  /// Nothing comes any more.
  void finish() {
    if (left_.samples > 0) end_run(left_by_);
    break_off();
    judge(std::exchange(first_, {}), kUnknown, first_left_by_);
  }

  /// At the greatest and the least value, so far; a run that has not ended does not count.
  [[nodiscard]] const Saturated& most() const { return most_; }
  [[nodiscard]] const Saturated& least() const { return least_; }
  /// A recording of one value: any instrument's noise reaches another code now and then.
  [[nodiscard]] bool stands_still() const { return values_ >= kLeastStill && most_.value == least_.value; }
  [[nodiscard]] int64_t samples() const { return most_.samples + least_.samples; }

 private:
  void end_run(double left_by) {
    const Saturated run = std::exchange(left_, {});
    const bool is_first = std::isnan(left_entered_by_) && values_ <= run.samples + 2;
    if (!is_first) return judge(run, left_entered_by_, left_by);
    first_ = run;  // how large a code is is not known yet
    first_left_by_ = left_by;
  }
  void judge(const Saturated& run, double entered_by, double left_by) {
    const double enough = std::fmax(kLeastStep_codes * code_, kLeastStep_part * (most_.value - least_.value));
    const bool is_cut_off =
        !(entered_by < enough) && !(left_by < enough) && !(std::isnan(entered_by) && std::isnan(left_by));
    for (Saturated* end : {&most_, &least_}) {
      if (run.samples == 0 || run.value != end->value || !is_cut_off) continue;
      end->samples += run.samples;
      ++end->runs;
    }
  }
  void break_off() {
    if (run_ >= kLeastRun) {
      left_ = {last_, run_, 1};
      left_entered_by_ = entered_by_;
      end_run(kUnknown);
    }
    run_ = 0;
    last_ = kUnknown;
  }

  static constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  static constexpr double kInfinite = std::numeric_limits<double>::infinity();
  Saturated most_{-kInfinite, 0, 0}, least_{kInfinite, 0, 0};
  double code_ = kInfinite;  ///< smallest step so far
  double last_ = kUnknown;
  double step_ = 0;        ///< to the last value
  double entered_by_ = 0;  ///< the run of equal values up to the last one; kUnknown after a gap
  int64_t run_ = 0;
  int64_t values_ = 0;
  Saturated first_;  ///< the run that the recording begins with, once it has ended
  double first_left_by_ = kUnknown;
  Saturated left_;  ///< a run that the last value has left: the next one shows by what steps
  double left_by_ = 0;
  double left_entered_by_ = 0;
};

}  // namespace diastole::signal
