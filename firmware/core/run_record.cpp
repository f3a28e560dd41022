#include "firmware/core/run_record.hpp"

#include "firmware/core/plan_check.hpp"

namespace diastole::firmware {

void RunRecord::report_plan(const Program& program, const Settings& settings) {
  if (next_planned_ == program.size || outbox_.room() < Outbox::kSlots / 2) return;
  const Segment& segment = program.segments[next_planned_];
  const SegmentPeaks peaks = segment_peaks(segment, settings);
  const Ticks start = Planner::segment_offset(program, settings, next_planned_);
  outbox_.put(wire::SegmentPlanned{
      .segment = static_cast<std::uint16_t>(next_planned_++),
      .start_us = on_wire(start) / kTicksPerMicrosecond,
      .duration_us = std::uint64_t{segment.period_us} * segment.cycles,
      .peak_flow_uL_per_s = static_cast<std::uint32_t>(peaks.flow_uL_per_s),
      .peak_acceleration_uL_per_s2 = static_cast<std::uint32_t>(peaks.acceleration_uL_per_s2),
      .peak_step_rate_Hz = static_cast<std::uint32_t>(peaks.step_rate_Hz),
      .peak_pressure_Pa = static_cast<std::uint32_t>(peaks.pressure_Pa),
      .cycle_microsteps = static_cast<std::uint32_t>(peaks.cycle_steps.count)});
}

void RunRecord::begin(Ticks start, const MotionCounters& before) {
  start_ = start;
  triggers_before_ = before.triggers;
  r_waves_before_ = before.r_waves;
  triggers_lost_before_ = before.triggers_lost;
  reason_ = wire::RunEnd::completed;
  segment_ = 0;
}

void RunRecord::take(const MotionReport& report, const Program& program) {
  const std::uint64_t tick = on_wire(report.tick);
  if ((report.flags & MotionEvent::kRunStart) != 0) {
    std::uint32_t cycles = 0;
    for (std::size_t i = 0; i < program.size; ++i)
      cycles += program.segments[i].cycles;
    outbox_.put(wire::RunStarted{tick, static_cast<std::uint16_t>(program.size), cycles});
    next_segment_ = 0;
    next_cycle_ = 0;
  }
  if ((report.flags & MotionEvent::kSegmentStart) != 0) {
    segment_ = next_segment_++;
    outbox_.put(wire::SegmentStarted{segment_, tick});
  }
  const bool lost = (report.flags & MotionEvent::kTriggerLost) != 0;
  if (lost || (report.flags & MotionEvent::kCycleStart) != 0) {
    const bool r_wave = (report.flags & MotionEvent::kRWave) != 0;
    outbox_.put(wire::Trigger{next_cycle_++, tick, static_cast<std::uint8_t>(r_wave),
                              static_cast<std::uint8_t>(!lost)});
  }
}

void RunRecord::end(Ticks tick, const MotionCounters& after) {
  end_due_ = wire::RunEnded{reason_,
                            on_wire(tick),
                            after.cycles_done,
                            after.triggers - triggers_before_,
                            after.r_waves - r_waves_before_,
                            after.position.count,
                            after.triggers_lost - triggers_lost_before_};
}

bool RunRecord::send_end() {
  if (!outbox_.put(*end_due_)) return false;
  end_due_.reset();
  return true;
}

}  // namespace diastole::firmware
