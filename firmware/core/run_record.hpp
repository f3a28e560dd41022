#pragma once
// A run as the host hears of it: the plan of each segment once armed, then start, segments and triggers as they happen,
// and the end with its sums.

#include <optional>

#include "firmware/core/outbox.hpp"
#include "firmware/core/program.hpp"
#include "firmware/core/step_engine.hpp"

namespace diastole::firmware {

class RunRecord {
 public:
  explicit RunRecord(Outbox& outbox) : outbox_(outbox) {}

  /// The program is armed: its segments are to be reported from the first on.
  void arm() { next_planned_ = 0; }
  /// One segment a call, so that a long program does not hold the turn up.
  void report_plan(const Program& program, const Settings& settings);

  void begin(Ticks start, const MotionCounters& before);
  /// Why the run will have ended.
  void set_reason(wire::RunEnd reason) { reason_ = reason; }
  [[nodiscard]] wire::RunEnd reason() const { return reason_; }
  /// What the engine reports of a run.
  void take(const MotionReport& report, const Program& program);
  void end(Ticks tick, const MotionCounters& after);

  /// A run's last event has been seen: send what is left of its positions, then call send_end().
  [[nodiscard]] bool end_due() const { return end_due_.has_value(); }
  /// False: the outbox is full. Precondition: end_due().
  bool send_end();

  /// Tick of the start of the present or last run.
  [[nodiscard]] Ticks start() const { return start_; }
  [[nodiscard]] std::uint16_t segment() const { return segment_; }

 private:
  Outbox& outbox_;
  std::size_t next_planned_ = 0;  ///< segment whose SegmentPlanned is due
  Ticks start_;
  std::uint16_t segment_ = 0;
  std::uint16_t next_segment_ = 0;
  std::uint32_t next_cycle_ = 0;
  std::uint32_t triggers_before_ = 0;
  std::uint32_t r_waves_before_ = 0, triggers_lost_before_ = 0;
  wire::RunEnd reason_ = wire::RunEnd::completed;
  std::optional<wire::RunEnded> end_due_;
};

}  // namespace diastole::firmware
