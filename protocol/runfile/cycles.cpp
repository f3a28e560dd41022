#include "protocol/runfile/cycles.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "protocol/runfile/soundness.hpp"

namespace diastole::runfile {
namespace {

/// A delayed trigger belongs to the segment in which its cycle begins.
bool lies_in(double trigger_s, double delay_s, const Segment& segment) {
  const double time_s = trigger_s - delay_s;
  const double slack_s = 0.5 * period_tolerance * segment.period_s;
  return time_s >= segment.start_s - slack_s && time_s < segment.end_s() - slack_s;
}

/// Whole periods between two moments, or 0 if it is not a whole number of at least one.
int64_t periods_between(double from_s, double to_s, double period_s) {
  const double interval_s = to_s - from_s;
  const auto periods = static_cast<int64_t>(std::llround(interval_s / period_s));
  const bool whole =
      std::abs(interval_s - static_cast<double>(periods) * period_s) <= period_tolerance * period_s;
  return whole ? periods : 0;
}

class Comparison {
 public:
  Comparison(const Segment& segment, double delay_s, SegmentTriggers& result)
      : segment_(segment), delay_s_(delay_s), triggers_(result.triggers), remarks_(result.remarks) {}

  void compare(bool stopped) {
    if (triggers_.empty()) {
      if (segment_.waveform != "hold" && !stopped) miss(segment_.start_s, segment_.cycles, "all of them");
      return;
    }
    begin();
    for (size_t i = 1; i < triggers_.size(); ++i)
      follow(i);
    const int64_t behind = segment_.cycles - 1 - triggers_[good_].cycle;
    if (behind > 0 && !stopped) miss(triggers_[good_].time_s, behind, "at the segment's end");
  }

 private:
  void begin() {
    CycleTrigger& first = triggers_.front();
    first.cycle =
        std::max<int64_t>(0, std::llround((first.time_s - delay_s_ - segment_.start_s) / segment_.period_s));
    if (first.cycle > 0) miss(segment_.start_s, first.cycle, "at the segment's start");
  }

  void follow(size_t i) {
    CycleTrigger& good = triggers_[good_];
    CycleTrigger& next = triggers_[i];
    const double interval_s = next.time_s - good.time_s;
    if (const int64_t periods = periods_between(good.time_s, next.time_s, segment_.period_s); periods > 0) {
      next.cycle = good.cycle + periods;
      if (periods > 1) {
        good.fault = fmt::format("the next trigger is missing: one came after {:.4f} s, not after {:.4f} s",
                                 interval_s, segment_.period_s);
        miss(good.time_s, periods - 1, fmt::format("after the one at {:.3f} s", good.time_s));
      }
      good_ = i;
    } else if (one_after_is_good(i)) {
      next.cycle = good.cycle;
      next.fault = fmt::format("its trigger is extra, {:.4f} s after the one before", interval_s);
      good.fault = fmt::format("an extra trigger came {:.4f} s after it began", interval_s);
      remark(TriggerFault::extra, next,
             fmt::format("trigger {} at {:.3f} s is extra, {:.4f} s after the one before", i, next.time_s,
                         interval_s));
    } else {
      next.cycle = good.cycle + std::max<int64_t>(1, std::llround(interval_s / segment_.period_s));
      good.fault = fmt::format("the next trigger came after {:.4f} s, not after {:.4f} s", interval_s,
                               segment_.period_s);
      remark(TriggerFault::non_periodic, next,
             fmt::format("trigger {} at {:.3f} s comes {:.4f} s after the one before, not {:.4f} s", i,
                         next.time_s, interval_s, segment_.period_s));
      good_ = i;
    }
  }

  [[nodiscard]] bool one_after_is_good(size_t i) const {
    const double from_s = triggers_[good_].time_s;
    for (size_t later = i + 1; later < triggers_.size(); ++later) {
      if (triggers_[later].time_s > triggers_[i].time_s + 1.5 * segment_.period_s) return false;
      if (periods_between(from_s, triggers_[later].time_s, segment_.period_s) > 0) return true;
    }
    return false;
  }

  void miss(double time_s, int64_t count, const std::string& where) {
    remarks_.push_back({TriggerFault::missing, time_s, count,
                        fmt::format("{} trigger{} missing {}", count, count == 1 ? " is" : "s are", where)});
  }
  void remark(TriggerFault fault, const CycleTrigger& at, std::string text) {
    remarks_.push_back({fault, at.time_s, 1, std::move(text)});
  }

  const Segment& segment_;
  double delay_s_;
  std::vector<CycleTrigger>& triggers_;
  std::vector<TriggerRemark>& remarks_;
  size_t good_ = 0;  // the last good one
};

}  // namespace

SegmentTriggers triggers_of(const RecordedRun& run, size_t segment) {
  SegmentTriggers result{.scheduled = run.segments[segment].cycles,
                         .delayed = run.trigger_delay_s > 0,
                         .triggers = {},
                         .remarks = {}};
  for (size_t row = 0; row < run.trigger_s.size(); ++row) {
    if (lies_in(run.trigger_s[row], run.trigger_delay_s, run.segments[segment]))
      result.triggers.push_back({run.trigger_s[row], row, 0, {}});
  }
  Comparison(run.segments[segment], run.trigger_delay_s, result).compare(was_stopped_on_request(run));
  return result;
}

std::vector<size_t> triggers_outside(const RecordedRun& run) {
  std::vector<size_t> rows;
  for (size_t row = 0; row < run.trigger_s.size(); ++row) {
    const bool inside = std::ranges::any_of(run.segments, [&](const Segment& segment) {
      return lies_in(run.trigger_s[row], run.trigger_delay_s, segment);
    });
    if (!inside) rows.push_back(row);
  }
  return rows;
}

}  // namespace diastole::runfile
