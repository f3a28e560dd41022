#pragma once
// Motion's requests: checks, then one change of state. Included by motion.hpp.

#include "firmware/core/motion.hpp"

namespace diastole::firmware {

template <Board B>
PlanRefusal Motion<B>::configure(const wire::Configure& configure) {
  if (!safety_.at_rest()) return {.refusal = wire::Refusal::wrong_state};
  if (machine_written_) {
    const PlanRefusal refusal = check_configuration(configure, machine_);
    if (refusal.refusal != wire::Refusal::none) return refusal;
  }
  settings_ = Settings(configure);
  configured_ = true;
  return {.refusal = clear_program()};
}

template <Board B>
void Motion<B>::use(const wire::MachineSettings& machine, bool written) {
  machine_ = machine;
  machine_written_ = written;
  backlash_steps_ = written ? wire::backlash_microsteps(machine) : 0;
  configured_ = false;
  program_.size = 0;
  if (safety_.at_rest()) become(wire::State::unhomed);
}

template <Board B>
wire::Refusal Motion<B>::clear_program() {
  if (!safety_.at_rest()) return wire::Refusal::wrong_state;
  program_.size = 0;
  waveforms_.clear();
  if (safety_.state() == wire::State::armed) become(wire::State::homed);
  return wire::Refusal::none;
}

/// Whether the program may be added to.
template <Board B>
wire::Refusal Motion<B>::program_open() const {
  if (!configured_) return wire::Refusal::not_configured;
  if (!safety_.at_rest() || safety_.state() == wire::State::armed) return wire::Refusal::wrong_state;
  return wire::Refusal::none;
}

template <Board B>
wire::Refusal Motion<B>::add_segment(const wire::AddSegment& add) {
  if (const wire::Refusal closed = program_open(); closed != wire::Refusal::none) return closed;
  if (program_.size == Program::kMaxSegments) return wire::Refusal::program_full;
  const UploadedWaveform* uploaded = nullptr;
  if (add.waveform == wire::Waveform::uploaded) {
    uploaded = waveforms_.find(add.upload);
    if (uploaded == nullptr) return wire::Refusal::waveform_missing;
  }
  program_.segments[program_.size++] = {add.waveform,  add.cycles,    add.stroke_nL,
                                        add.offset_nL, add.period_us, uploaded};
  return wire::Refusal::none;
}

template <Board B>
wire::Refusal Motion<B>::upload(const wire::UploadWaveform& upload) {
  if (const wire::Refusal closed = program_open(); closed != wire::Refusal::none) return closed;
  return waveforms_.begin(upload.waveform, upload.points, upload.crc);
}

template <Board B>
wire::Refusal Motion<B>::upload(const wire::WaveformPoints& points) {
  if (const wire::Refusal closed = program_open(); closed != wire::Refusal::none) return closed;
  return waveforms_.append(points.first, std::span(points.rise).first(points.count));
}

template <Board B>
PlanRefusal Motion<B>::arm(const wire::Arm& arm) {
  if (!configured_) return {.refusal = wire::Refusal::not_configured};
  if (safety_.state() != wire::State::homed) return {.refusal = wire::Refusal::wrong_state};
  program_.gate_every = arm.gate_every;
  program_.rest_us = arm.rest_us;
  program_.ttl_width_us = arm.ttl_width_us;
  program_.trigger_delay_us = arm.trigger_delay_us;
  program_.position_period_ticks = arm.position_period_ticks;
  const auto stopping_time = check_program(program_, settings_);
  if (!stopping_time.ok()) return stopping_time.error();
  const auto window_us = check_take_up(program_, settings_, backlash_steps_);
  if (!window_us.ok()) return window_us.error();
  take_up_window_ = microseconds(*window_us);
  // At rest within the lease: stop that much earlier, and by what has already been handed to the engine.
  silence_allowed_ =
      microseconds(settings_.limits().lease_us - 5'000) - *stopping_time - kHorizon - take_up_window_;
  next_planned_ = 0;
  become(wire::State::armed);
  return {};
}

template <Board B>
wire::Refusal Motion<B>::home(std::uint32_t lease_id) {
  if (!configured_) return wire::Refusal::not_configured;
  if (!safety_.at_rest() || fault_pending()) return wire::Refusal::wrong_state;
  if (board_.inputs().estop) return wire::Refusal::estop_pressed;
  silence_allowed_ = hand_silence();
  if (!lease_.bind(lease_id, board_.now(), silence_allowed_)) return wire::Refusal::no_lease;
  fault_at_rest_ = wire::Fault::none;
  decelerating_ = false;
  taking_up_ = false;
  set_motor_enabled(true);
  become(wire::State::homing);
  begin_homing_stage(board_.inputs().home ? HomingStage::back_off : HomingStage::seek);
  return wire::Refusal::none;
}

template <Board B>
PlanRefusal Motion<B>::jog(const wire::Jog& jog) {
  const wire::State state = safety_.state();
  if (!configured_) return {.refusal = wire::Refusal::not_configured};
  if ((state != wire::State::unhomed && state != wire::State::homed) || fault_pending() || run_end_due_)
    return {.refusal = wire::Refusal::wrong_state};
  const bool inflate = jog.distance_nL > 0;
  const Inputs inputs = board_.inputs();
  if (inputs.estop) return {.refusal = wire::Refusal::estop_pressed};
  if (inflate && inputs.far_limit) return {.refusal = wire::Refusal::limit_switch_closed};
  if (!inflate && inputs.home) return {.refusal = wire::Refusal::home_switch_closed};
  const PlanRefusal excess = check_jog(jog, settings_, safety_.position_known(), engine_.counters().position);
  if (excess.refusal != wire::Refusal::none) return excess;
  const Glide glide = jog_glide(jog, settings_);
  silence_allowed_ = hand_silence();
  if (!lease_.bind(jog.lease_id, board_.now(), silence_allowed_)) return {.refusal = wire::Refusal::no_lease};
  fault_at_rest_ = wire::Fault::none;
  decelerating_ = false;
  set_motor_enabled(true);
  watch_ = inflate ? Watch::inflating : inputs.far_limit ? Watch::withdrawing_from_far : Watch::withdrawing;
  become(wire::State::jogging);
  engine_.open();
  const Ticks start = board_.now() + kStartLead;
  planner_.begin_glide(inflate, glide, start);
  const std::uint32_t window_us =
      take_up_window_us(backlash_steps_, settings_.stop_steps_per_s2() / 4, settings_);
  begin_taking_up(microseconds(window_us), start);
  taking_up_ = taking_up_ && safety_.position_known();
  return {};
}

template <Board B>
wire::Refusal Motion<B>::start(std::uint32_t lease_id) {
  if (safety_.state() != wire::State::armed || fault_pending() || run_end_due_)
    return wire::Refusal::wrong_state;
  if (board_.inputs().estop) return wire::Refusal::estop_pressed;
  if (board_.inputs().far_limit) return wire::Refusal::limit_switch_closed;
  if (!lease_.bind(lease_id, board_.now(), silence_allowed_)) return wire::Refusal::no_lease;
  const MotionCounters counters = engine_.counters();
  triggers_before_ = counters.triggers;
  r_waves_before_ = counters.r_waves;
  engine_.open();
  engine_.begin_counting_run();
  engine_.set_trigger(microseconds(program_.ttl_width_us), microseconds(program_.trigger_delay_us));
  run_start_ = board_.now() + kStartLead;
  engine_.begin_sampling(run_start_, Ticks{program_.position_period_ticks});
  planner_.begin_run(program_, settings_, run_start_, counters.position);
  begin_taking_up(take_up_window_, run_start_);
  end_reason_ = wire::RunEnd::completed;
  fault_at_rest_ = wire::Fault::none;
  decelerating_ = false;
  segment_ = 0;
  set_motor_enabled(true);
  watch_ = Watch::run;
  become(wire::State::running);
  return wire::Refusal::none;
}

template <Board B>
wire::Refusal Motion<B>::stop_at_cycle_end() {
  if (safety_.state() != wire::State::running) return wire::Refusal::wrong_state;
  planner_.stop_at_cycle_end();
  end_reason_ = wire::RunEnd::stopped_at_cycle_end;
  become(wire::State::stopping);
  return wire::Refusal::none;
}

template <Board B>
wire::Refusal Motion<B>::stop_now() {
  if (!safety_.in_run() && !homing_or_jogging()) return wire::Refusal::wrong_state;
  begin_controlled_stop(wire::RunEnd::stopped_now);
  return wire::Refusal::none;
}

template <Board B>
wire::Refusal Motion<B>::halt() {
  take_tripped_fault();  // what cut the motor off before this halt is the fault to be told
  if (safety_.at_rest() || safety_.state() == wire::State::faulted) return wire::Refusal::wrong_state;
  engine_.cut();
  latch(wire::Fault::halted);
  return wire::Refusal::none;
}

template <Board B>
wire::Refusal Motion<B>::clear_fault() {
  if (safety_.state() != wire::State::faulted) return wire::Refusal::wrong_state;
  if (board_.inputs().estop) return wire::Refusal::estop_pressed;
  const wire::State before = safety_.state();
  safety_.clear();
  board_.show_fault(static_cast<std::uint8_t>(wire::Fault::none));
  tell_state(before, safety_.state());
  return wire::Refusal::none;
}

template <Board B>
void Motion<B>::let_go() {
  safety_.forget_position();
  set_motor_enabled(false);
}

}  // namespace diastole::firmware
