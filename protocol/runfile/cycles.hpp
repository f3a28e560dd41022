#pragma once
// The triggers of a segment, set against its schedule: which cycle each one begins, and which are missing,
// extra or out of time.
//
// Going from trigger to trigger, with t the last good one and P the segment's period, the next at t' is
//   good          if t' - t = n P within 1 % of P; then n - 1 triggers between them are missing
//   extra         if it is not, but one after it is good
//   non-periodic  otherwise; the count goes on from it
//
//     |     |     |           |  :  |     |   |     |     |
//                    missing    extra      non-periodic
//
// The first trigger is compared with the segment's start, the last with the number of cycles.

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

/// Of the period, between triggers.
inline constexpr double period_tolerance = 0.01;

struct CycleTrigger {
  double time_s = 0;
  size_t row = 0;     ///< of /trigger/time_s
  int64_t cycle = 0;  ///< of the segment, from 0, missing ones counted; that of the trigger before, if extra
  std::string fault;  ///< why the cycle from here to the next trigger is out of tolerance; empty if it is not
};

enum class TriggerFault { missing, extra, non_periodic };

struct TriggerRemark {
  TriggerFault fault{};
  double time_s = 0;
  int64_t count = 1;  ///< of triggers missing
  std::string text;   ///< in words, with place and time
};

struct SegmentTriggers {
  int64_t scheduled = 0;
  bool delayed = false;                ///< the last interval reaches beyond the segment
  std::vector<CycleTrigger> triggers;  ///< as recorded, in order
  std::vector<TriggerRemark> remarks;

  [[nodiscard]] int64_t count(TriggerFault fault) const {
    int64_t total = 0;
    for (const TriggerRemark& remark : remarks)
      total += remark.fault == fault ? remark.count : 0;
    return total;
  }
};

/// Precondition: `segment` is one of the run. A run that was stopped on request misses none at its end.
SegmentTriggers triggers_of(const RecordedRun& run, size_t segment);

/// Rows of /trigger/time_s that lie in no segment: nothing there should raise one.
std::vector<size_t> triggers_outside(const RecordedRun& run);

}  // namespace diastole::runfile
