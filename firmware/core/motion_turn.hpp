#pragma once
// Motion's turn of the main loop and its input interrupt. Included by motion.hpp.

#include "firmware/core/motion.hpp"

namespace diastole::firmware {

template <Board B>
void Motion<B>::poll() {
  {
    typename B::InterruptLock lock(board_);
    on_inputs();
  }
  if (engine_.take_underrun()) trip(wire::Fault::step_underrun);
  note_estop();
  take_tripped_fault();
  watch_lease();
  run_homing();
  refill();
  take_reports();
  report_plan();
}

/// Input interrupt, and once a turn in case that an edge was too short for it. E-stop first.
template <Board B>
void Motion<B>::on_inputs() {
  const Inputs inputs = board_.inputs();
  const Watch watch = watch_;
  if (inputs.estop) {
    trip(wire::Fault::estop);
  } else if (watch == Watch::run && inputs.far_limit) {
    trip(wire::Fault::limit_switch);
  } else if (watch == Watch::run && inputs.home) {
    trip(wire::Fault::home_switch);
  } else if ((watch == Watch::approach_home && inputs.home) || (watch == Watch::leave_home && !inputs.home)) {
    engine_.cut();
  } else if ((watch == Watch::leave_home || watch == Watch::inflating || watch == Watch::withdrawing) &&
             inputs.far_limit) {
    trip(wire::Fault::limit_switch);
  } else if ((watch == Watch::withdrawing || watch == Watch::withdrawing_from_far) && inputs.home) {
    trip(wire::Fault::home_switch);
  }
}

/// Cuts the motion off at once; the main loop does the rest. Interrupt or main loop.
template <Board B>
void Motion<B>::trip(wire::Fault fault) {
  if (tripped_ != wire::Fault::none || safety_.state() == wire::State::faulted) return;
  tripped_ = fault;
  engine_.cut();
  board_.set_motor_enabled(false);
  board_.show_fault(static_cast<std::uint8_t>(fault));
}

template <Board B>
void Motion<B>::take_tripped_fault() {
  if (safety_.state() == wire::State::faulted && board_.inputs().estop) {
    safety_.forget_position();
    set_motor_enabled(false);
  }
  const wire::Fault fault = tripped_;
  if (fault == wire::Fault::none) return;
  set_motor_enabled(false);  // the request that was interrupted may have switched it on again
  latch(fault);
  tripped_ = wire::Fault::none;
}

template <Board B>
void Motion<B>::become(wire::State to) {
  const wire::State from = safety_.state();
  if (safety_.become(to)) tell_state(from, to);
}

template <Board B>
void Motion<B>::tell_state(wire::State from, wire::State to) {
  const Ticks now = board_.now();
  outbox_.put(wire::StateChanged{from, to, on_wire(now)});
  black_box_.note(wire::Noted::state, static_cast<std::uint8_t>(to), static_cast<std::int32_t>(from), now);
}

template <Board B>
void Motion<B>::note_estop() {
  const bool pressed = board_.inputs().estop;
  if (pressed == estop_seen_) return;
  estop_seen_ = pressed;
  black_box_.note(wire::Noted::estop, pressed ? 1 : 0, 0, board_.now());
}

/// Latches a fault with the motor already at rest or cut off.
template <Board B>
void Motion<B>::latch(wire::Fault fault) {
  const wire::State from = safety_.state();
  const bool in_run = safety_.in_run();
  if (!safety_.latch(fault)) return;
  const Ticks now = board_.now();
  planner_.clear();
  taking_up_ = false;
  homing_ = HomingStage::done;
  board_.show_fault(static_cast<std::uint8_t>(fault));
  const std::int64_t argument =
      fault == wire::Fault::event_overflow ? events_lost_ : engine_.counters().position.count;
  outbox_.put(wire::FaultRaised{fault, on_wire(now), argument});
  black_box_.note(wire::Noted::fault, static_cast<std::uint8_t>(fault), static_cast<std::int32_t>(argument),
                  now);
  tell_state(from, wire::State::faulted);
  if (!in_run) {
    watch_ = Watch::rest;
    lease_.release();
    return;
  }
  if (end_reason_ != wire::RunEnd::lease_lost) end_reason_ = wire::RunEnd::faulted;
  end_motion(now);
}

template <Board B>
void Motion<B>::set_motor_enabled(bool enabled) {
  motor_enabled_ = enabled;
  board_.set_motor_enabled(enabled);
}

template <Board B>
void Motion<B>::watch_lease() {
  if (!lease_.lost(board_.now(), silence_allowed_)) return;
  if ((safety_.in_run() || homing_or_jogging()) && fault_at_rest_ == wire::Fault::none) {
    fault_at_rest_ = wire::Fault::lease_lost;
    begin_controlled_stop(wire::RunEnd::lease_lost);
  }
}

template <Board B>
void Motion<B>::begin_controlled_stop(wire::RunEnd reason) {
  end_reason_ = reason;
  if (safety_.state() == wire::State::running) become(wire::State::stopping);
  if (safety_.state() == wire::State::homing) {
    homing_ = HomingStage::stopped;
    // The switch may just have cut a stage off, and must not cut the stop off.
    if (watch_ == Watch::approach_home) watch_ = Watch::rest;
    if (watch_ == Watch::leave_home) watch_ = Watch::inflating;
    if (engine_.closed()) engine_.open();
  }
  if (decelerating_) return;
  decelerating_ = true;
  planner_.begin_stop(board_.now() + microseconds(1'000), settings_.stop_steps_per_s2(),
                      taking_up_ && take_up_.turning());
}

template <Board B>
bool Motion<B>::homing_or_jogging() const {
  return safety_.state() == wire::State::homing || safety_.state() == wire::State::jogging;
}

template <Board B>
void Motion<B>::begin_homing_stage(HomingStage stage) {
  homing_ = stage;
  decelerating_ = false;
  const bool withdraws_from_far = stage == HomingStage::seek && board_.inputs().far_limit;
  watch_ = withdraws_from_far               ? Watch::rest
           : stage == HomingStage::approach ? Watch::approach_home
           : stage == HomingStage::leave    ? Watch::leave_home
                                            : Watch::inflating;
  const HomingMove move = homing_move(stage, settings_, backlash_steps_);
  engine_.open();
  planner_.begin_glide(move.inflate, move.glide, board_.now() + kHomingPause);
}

/// Where the switch has changed: from the fast stages to rest (take_end goes on); the slow ones are cut off already.
template <Board B>
void Motion<B>::run_homing() {
  if (safety_.state() != wire::State::homing) return;
  const bool closed = board_.inputs().home;
  if (homing_ == HomingStage::seek ? closed : homing_ == HomingStage::back_off && !closed) {
    if (!std::exchange(decelerating_, true))
      planner_.begin_stop(board_.now() + microseconds(1'000), settings_.stop_steps_per_s2());
  } else if (homing_ == HomingStage::approach && closed) {
    begin_homing_stage(HomingStage::leave);
  } else if (homing_ == HomingStage::leave && !closed) {
    begin_homing_stage(HomingStage::clearance);
  }
}

/// A stage of homing has come to its end.
template <Board B>
void Motion<B>::end_homing_stage() {
  switch (homing_) {
    case HomingStage::seek:
      return decelerating_ ? begin_homing_stage(HomingStage::back_off) : latch(wire::Fault::homing_failed);
    case HomingStage::back_off:
      return decelerating_ ? begin_homing_stage(HomingStage::approach)
                           : latch(wire::Fault::home_switch_stuck);
    case HomingStage::approach:
      return latch(wire::Fault::homing_failed);
    case HomingStage::leave:
      return latch(wire::Fault::home_switch_stuck);
    case HomingStage::clearance:
      engine_.set_position(Steps{0});
      take_up_.home();
      return come_to_rest(wire::State::homed);
    default:
      return come_to_rest(wire::State::unhomed);
  }
}

template <Board B>
void Motion<B>::come_to_rest(wire::State state) {
  homing_ = HomingStage::done;
  watch_ = Watch::rest;
  lease_.release();
  become(state);
}

template <Board B>
void Motion<B>::refill() {
  const Ticks until = board_.now() + kHorizon;
  if (taking_up_) return refill_taking_up(until);
  for (const MotionEvent* next = planner_.peek(); next != nullptr; next = planner_.peek()) {
    if (next->tick > until || engine_.full()) return;
    engine_.push(*next);
    planner_.pop();
  }
}

template <Board B>
void Motion<B>::refill_taking_up(Ticks until) {
  while (!engine_.full()) {
    const MotionEvent* next = take_up_.merge(planner_.peek());
    if (next == nullptr || next->tick > until) return;
    engine_.push(*next);
    if (take_up_.pop()) planner_.pop();
  }
}

template <Board B>
void Motion<B>::begin_taking_up(Ticks window, Ticks start) {
  taking_up_ = backlash_steps_ > 0;
  const std::uint32_t rate_Hz = settings_.limits().step_rate_Hz;
  take_up_.begin(backlash_steps_, window, Ticks{(kTicksPerSecond + rate_Hz - 1) / rate_Hz}, start);
}

/// One segment a turn, so that a long program does not hold the turn up.
template <Board B>
void Motion<B>::report_plan() {
  if (safety_.state() != wire::State::armed || next_planned_ == program_.size) return;
  if (outbox_.room() < Outbox::kSlots / 2) return;
  const Segment& segment = program_.segments[next_planned_];
  const SegmentPeaks peaks = segment_peaks(segment, settings_);
  const Ticks start = Planner::segment_offset(program_, settings_, next_planned_);
  wire::SegmentPlanned planned;
  planned.segment = static_cast<std::uint16_t>(next_planned_++);
  planned.start_us = on_wire(start) / kTicksPerMicrosecond;
  planned.duration_us = std::uint64_t{segment.period_us} * segment.cycles;
  planned.peak_flow_uL_per_s = static_cast<std::uint32_t>(peaks.flow_uL_per_s);
  planned.peak_acceleration_uL_per_s2 = static_cast<std::uint32_t>(peaks.acceleration_uL_per_s2);
  planned.peak_step_rate_Hz = static_cast<std::uint32_t>(peaks.step_rate_Hz);
  planned.peak_pressure_Pa = static_cast<std::uint32_t>(peaks.pressure_Pa);
  planned.cycle_microsteps = static_cast<std::uint32_t>(peaks.cycle_steps.count);
  outbox_.put(planned);
}

template <Board B>
void Motion<B>::take_reports() {
  engine_.settle_trigger();
  auto& reports = engine_.reports();
  while (const MotionReport* report = reports.front()) {
    if (outbox_.room() < Outbox::kSlots / 2) break;
    take_report(*report);
    reports.pop();
  }
  const std::uint32_t lost = engine_.take_lost();
  events_lost_ += lost;
  if (lost > 0 && safety_.in_run() && fault_at_rest_ == wire::Fault::none) {
    fault_at_rest_ = wire::Fault::event_overflow;
    begin_controlled_stop(wire::RunEnd::faulted);
  }
}

template <Board B>
void Motion<B>::take_report(const MotionReport& report) {
  const std::uint64_t tick = on_wire(report.tick);
  if ((report.flags & MotionEvent::kRunStart) != 0) {
    std::uint32_t cycles = 0;
    for (std::size_t i = 0; i < program_.size; ++i)
      cycles += program_.segments[i].cycles;
    outbox_.put(wire::RunStarted{tick, static_cast<std::uint16_t>(program_.size), cycles});
    next_segment_ = 0;
    next_cycle_ = 0;
  }
  if ((report.flags & MotionEvent::kSegmentStart) != 0) {
    segment_ = next_segment_++;
    outbox_.put(wire::SegmentStarted{segment_, tick});
  }
  if ((report.flags & MotionEvent::kCycleStart) != 0) {
    const bool r_wave = (report.flags & MotionEvent::kRWave) != 0;
    outbox_.put(wire::Trigger{next_cycle_++, tick, static_cast<std::uint8_t>(r_wave)});
  }
  if ((report.flags & MotionEvent::kEnd) != 0) take_end(report.tick);
}

/// Everything planned has been done.
template <Board B>
void Motion<B>::take_end(Ticks tick) {
  if (fault_at_rest_ != wire::Fault::none && (safety_.in_run() || homing_or_jogging())) {
    latch(fault_at_rest_);
  } else if (safety_.in_run()) {
    end_motion(tick);
  } else if (safety_.state() == wire::State::homing) {
    end_homing_stage();
  } else if (safety_.state() == wire::State::jogging) {
    come_to_rest(safety_.position_known() ? wire::State::homed : wire::State::unhomed);
  }
}

template <Board B>
void Motion<B>::end_motion(Ticks tick) {
  watch_ = Watch::rest;
  lease_.release();
  engine_.drop_trigger();
  engine_.stop_sampling(tick);
  const MotionCounters counters = engine_.counters();
  run_end_due_ = wire::RunEnded{end_reason_,
                                on_wire(tick),
                                counters.cycles_done,
                                counters.triggers - triggers_before_,
                                counters.r_waves - r_waves_before_,
                                counters.position.count};
}

template <Board B>
void Motion<B>::report_run_end() {
  if (!outbox_.put(*run_end_due_)) return;
  run_end_due_.reset();
  if (safety_.in_run()) become(wire::State::homed);
}

}  // namespace diastole::firmware
