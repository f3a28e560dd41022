#pragma once
// Everything that moves or may not move: which request the state allows, and which state follows. What is moved and how
// is with its parts:
//
//   ProgramStore  what is configured and loaded        StepFeed        from plan to queue, stops
//   InputWatch    what cuts off in hardware time       HomingSequence  the stages of homing
//   RunRecord     what the host hears of a run         Safety, Lease   states, and the host's word
//
// Requests return Refusal::none or why not; what happens later is reported through the outbox. on_match() and
// on_inputs() are called from interrupts, everything else from the main loop.

#include "firmware/core/black_box.hpp"
#include "firmware/core/board.hpp"
#include "firmware/core/homing_sequence.hpp"
#include "firmware/core/input_watch.hpp"
#include "firmware/core/jog.hpp"
#include "firmware/core/lease.hpp"
#include "firmware/core/outbox.hpp"
#include "firmware/core/program_store.hpp"
#include "firmware/core/run_record.hpp"
#include "firmware/core/safety.hpp"
#include "firmware/core/step_engine.hpp"
#include "firmware/core/step_feed.hpp"

namespace diastole::firmware {

template <Board B>
class Motion {
 public:
  static constexpr Ticks kHorizon = StepFeed<B>::kHorizon;
  /// From the order to move to the first event.
  static constexpr Ticks kStartLead = microseconds(20'000);

  Motion(B& board, Outbox& outbox, BlackBox& black_box)
      : board_(board), outbox_(outbox), black_box_(black_box), engine_(board) {}

  // Requests (main loop): checks, then one change of state.

  /// Geometry and limits; the program is cleared.
  PlanRefusal configure(const wire::Configure& configure) {
    if (!safety_.at_rest()) return {.refusal = wire::Refusal::wrong_state};
    const PlanRefusal refusal = store_.configure(configure);
    if (refusal.refusal == wire::Refusal::none) disarm();
    return refusal;
  }
  /// Settings from flash. The position is forgotten too: its unit may have changed.
  void use(const wire::MachineSettings& machine, bool written) {
    store_.use(machine, written);
    board_.use_signals(SignalSettings(machine));
    if (safety_.at_rest()) become(wire::State::unhomed);
  }
  wire::Refusal clear_program() {
    if (!safety_.at_rest()) return wire::Refusal::wrong_state;
    store_.clear();
    disarm();
    return wire::Refusal::none;
  }
  wire::Refusal add_segment(const wire::AddSegment& add) {
    const wire::Refusal closed = program_closed();
    return closed != wire::Refusal::none ? closed : store_.add(add);
  }
  /// UploadWaveform or WaveformPoints.
  template <class Upload>
  wire::Refusal upload(const Upload& upload) {
    const wire::Refusal closed = program_closed();
    return closed != wire::Refusal::none ? closed : store_.upload(upload);
  }
  /// Checks the program; its segments are reported in the following turns; PlanRefusal{none} if it is
  /// accepted.
  PlanRefusal arm(const wire::Arm& arm) {
    if (!store_.configured()) return {.refusal = wire::Refusal::not_configured};
    if (safety_.state() != wire::State::homed) return {.refusal = wire::Refusal::wrong_state};
    const PlanRefusal refusal = store_.arm(arm);
    if (refusal.refusal != wire::Refusal::none) return refusal;
    run_.arm();
    become(wire::State::armed);
    return {};
  }
  wire::Refusal home(std::uint32_t lease_id) {
    if (!store_.configured()) return wire::Refusal::not_configured;
    if (!safety_.at_rest() || fault_pending()) return wire::Refusal::wrong_state;
    if (board_.inputs().estop) return wire::Refusal::estop_pressed;
    if (!lease_.bind(lease_id, board_.now(), hand_silence())) return wire::Refusal::no_lease;
    begin_motion();
    become(wire::State::homing);
    homing_.begin();
    return wire::Refusal::none;
  }
  /// Unhomed or homed; the first limit that it would exceed is returned.
  PlanRefusal jog(const wire::Jog& jog) {
    const wire::State state = safety_.state();
    if (!store_.configured()) return {.refusal = wire::Refusal::not_configured};
    if ((state != wire::State::unhomed && state != wire::State::homed) || fault_pending() || run_.end_due())
      return {.refusal = wire::Refusal::wrong_state};
    const bool inflate = jog.distance_nL > 0;
    const Inputs inputs = board_.inputs();
    if (inputs.estop) return {.refusal = wire::Refusal::estop_pressed};
    if (inflate && inputs.far_limit) return {.refusal = wire::Refusal::limit_switch_closed};
    if (!inflate && inputs.home) return {.refusal = wire::Refusal::home_switch_closed};
    const bool known = safety_.position_known();
    const PlanRefusal excess = check_jog(jog, store_.settings(), known, engine_.counters().position);
    if (excess.refusal != wire::Refusal::none) return excess;
    if (!lease_.bind(jog.lease_id, board_.now(), hand_silence())) return {.refusal = wire::Refusal::no_lease};
    begin_motion();
    inputs_.watch(inflate            ? Watch::inflating
                  : inputs.far_limit ? Watch::withdrawing_from_far
                                     : Watch::withdrawing);
    become(wire::State::jogging);
    engine_.open();
    feed_.begin_jog(store_, inflate, jog_move(jog, store_.settings()), board_.now() + kStartLead, known);
    return {};
  }
  wire::Refusal start(std::uint32_t lease_id) {
    if (safety_.state() != wire::State::armed || fault_pending() || run_.end_due())
      return wire::Refusal::wrong_state;
    if (board_.inputs().estop) return wire::Refusal::estop_pressed;
    if (board_.inputs().far_limit) return wire::Refusal::limit_switch_closed;
    if (!lease_.bind(lease_id, board_.now(), run_silence())) return wire::Refusal::no_lease;
    const MotionCounters counters = engine_.counters();
    engine_.open();
    engine_.begin_counting_run();
    engine_.set_trigger(microseconds(program().ttl_width_us), microseconds(program().trigger_delay_us));
    const Ticks start = board_.now() + kStartLead;
    engine_.begin_sampling(start, Ticks{program().position_period_ticks});
    feed_.begin_run(store_, start, counters.position);
    run_.begin(start, counters);
    begin_motion();
    inputs_.watch(Watch::run);
    become(wire::State::running);
    return wire::Refusal::none;
  }
  wire::Refusal stop_at_cycle_end() {
    if (safety_.state() != wire::State::running) return wire::Refusal::wrong_state;
    feed_.stop_at_cycle_end();
    run_.set_reason(wire::RunEnd::stopped_at_cycle_end);
    become(wire::State::stopping);
    return wire::Refusal::none;
  }
  wire::Refusal stop_now() {
    if (!moving()) return wire::Refusal::wrong_state;
    stop(wire::RunEnd::stopped_now);
    return wire::Refusal::none;
  }
  wire::Refusal halt() {
    latch_trip();  // what cut the motor off before this halt is the fault to be reported
    if (safety_.at_rest() || safety_.state() == wire::State::faulted) return wire::Refusal::wrong_state;
    engine_.cut();
    latch(wire::Fault::halted);
    return wire::Refusal::none;
  }
  wire::Refusal clear_fault() {
    if (safety_.state() != wire::State::faulted) return wire::Refusal::wrong_state;
    if (board_.inputs().estop) return wire::Refusal::estop_pressed;
    if (stays_faulted_) return wire::Refusal::wrong_state;
    const wire::State before = safety_.state();
    safety_.clear();
    board_.show_fault(static_cast<std::uint8_t>(wire::Fault::none));
    report_state(before, safety_.state());
    return wire::Refusal::none;
  }
  /// Takes the motor's current away; the position is then unknown. Precondition: at rest.
  void let_go() {
    safety_.forget_position();
    set_motor_enabled(false);
  }
  /// Latches what only another start can clear: nothing moves until then. Precondition: at rest.
  void stay_faulted(wire::Fault fault) {
    stays_faulted_ = true;
    latch(fault);
  }
  /// What forbids pulses that nothing may follow: a motion, a program that waits for its start, a motor with current.
  [[nodiscard]] wire::Refusal self_test_refusal() const {
    const wire::State state = safety_.state();
    if ((state != wire::State::unhomed && state != wire::State::homed && state != wire::State::faulted) ||
        fault_pending() || run_.end_due())
      return wire::Refusal::wrong_state;
    return motor_enabled_ ? wire::Refusal::motor_powered : wire::Refusal::none;
  }
  void heartbeat(std::uint32_t lease_id) { lease_.heartbeat(lease_id, board_.now()); }

  /// One turn of the main loop: faults, lease, homing, refilling the queue, reports.
  void poll() {
    {
      typename B::InterruptLock lock(board_);
      on_inputs();
    }
    if (engine_.take_underrun()) inputs_.trip(wire::Fault::step_underrun);
    note_estop();
    latch_trip();
    if (lease_.lost(board_.now())) stop_for(wire::Fault::lease_lost, wire::RunEnd::lease_lost);
    if (safety_.state() == wire::State::homing) homing_.turn();
    feed_.refill(board_.now());
    take_reports();
    if (safety_.state() == wire::State::armed) run_.report_plan(program(), store_.settings());
  }

  // Interrupts.
  void on_match() { engine_.on_match(); }
  void on_inputs() { inputs_.on_inputs(); }

  [[nodiscard]] const Safety& safety() const { return safety_; }
  [[nodiscard]] StepEngine<B>& engine() { return engine_; }
  [[nodiscard]] const StepEngine<B>& engine() const { return engine_; }
  [[nodiscard]] const Program& program() const { return store_.program(); }
  [[nodiscard]] const RunRecord& run() const { return run_; }
  [[nodiscard]] std::uint32_t events_lost() const { return events_lost_ + outbox_.lost(); }
  [[nodiscard]] bool motor_enabled() const { return motor_enabled_; }
  /// Precondition: run().end_due(), and the run's positions have been sent.
  void report_run_end() {
    if (run_.send_end() && safety_.in_run()) become(wire::State::homed);
  }

 private:
  /// Whether the program may be added to.
  [[nodiscard]] wire::Refusal program_closed() const {
    if (!store_.configured()) return wire::Refusal::not_configured;
    if (!safety_.at_rest() || safety_.state() == wire::State::armed) return wire::Refusal::wrong_state;
    return wire::Refusal::none;
  }
  void disarm() {
    if (safety_.state() == wire::State::armed) become(wire::State::homed);
  }
  /// An interrupt has cut the motion off and the main loop has not latched the fault yet.
  [[nodiscard]] bool fault_pending() const { return inputs_.tripped() != wire::Fault::none; }
  /// In a run, homing or jogging.
  [[nodiscard]] bool moving() const {
    return safety_.in_run() || safety_.state() == wire::State::homing ||
           safety_.state() == wire::State::jogging;
  }
  /// Silence of the host until a stop begins: at rest within the lease at up to Settings::hand_steps_per_s.
  [[nodiscard]] Ticks hand_silence() const {
    return microseconds(store_.settings().limits().lease_us / 4 * 3 - 5'000) - kHorizon;
  }
  /// … in the armed program: earlier by its stopping time, and by what has already been handed to the engine.
  [[nodiscard]] Ticks run_silence() const {
    return microseconds(store_.settings().limits().lease_us - 5'000) - store_.stopping_time() - kHorizon -
           store_.compensation_window();
  }

  void begin_motion() {
    fault_at_rest_ = wire::Fault::none;
    set_motor_enabled(true);
  }
  void stop(wire::RunEnd reason) {
    run_.set_reason(reason);
    if (safety_.state() == wire::State::running) become(wire::State::stopping);
    if (safety_.state() == wire::State::homing) homing_.stop();
    feed_.stop(board_.now(), store_.settings());
  }
  /// Stops under control and latches the fault once at rest.
  void stop_for(wire::Fault fault, wire::RunEnd reason) {
    if (!moving() || fault_at_rest_ != wire::Fault::none) return;
    fault_at_rest_ = fault;
    stop(reason);
  }

  void become(wire::State to) {
    const wire::State from = safety_.state();
    if (safety_.become(to)) report_state(from, to);
  }
  void report_state(wire::State from, wire::State to) {
    const Ticks now = board_.now();
    outbox_.put(wire::StateChanged{from, to, on_wire(now)});
    black_box_.note(wire::Noted::state, static_cast<std::uint8_t>(to), static_cast<std::int32_t>(from), now);
  }
  void note_estop() {
    const bool pressed = board_.inputs().estop;
    if (pressed == estop_seen_) return;
    estop_seen_ = pressed;
    black_box_.note(wire::Noted::estop, pressed ? 1 : 0, 0, board_.now());
  }
  void set_motor_enabled(bool enabled) {
    motor_enabled_ = enabled;
    board_.set_motor_enabled(enabled);
  }

  void latch_trip() {
    if (safety_.state() == wire::State::faulted && board_.inputs().estop) let_go();
    if (!fault_pending()) return;
    set_motor_enabled(false);  // the request that was interrupted may have switched it on again
    latch(inputs_.tripped());
    inputs_.forget_trip();
  }
  /// Latches a fault with the motor already at rest or cut off.
  void latch(wire::Fault fault) {
    const wire::State from = safety_.state();
    const bool in_run = safety_.in_run();
    if (!safety_.latch(fault)) return;
    const Ticks now = board_.now();
    feed_.clear();
    homing_.forget();
    board_.show_fault(static_cast<std::uint8_t>(fault));
    const std::int64_t argument =
        fault == wire::Fault::event_overflow ? events_lost_ : engine_.counters().position.count;
    outbox_.put(wire::FaultRaised{fault, on_wire(now), argument});
    black_box_.note(wire::Noted::fault, static_cast<std::uint8_t>(fault), static_cast<std::int32_t>(argument),
                    now);
    report_state(from, wire::State::faulted);
    if (!in_run) return release();
    if (run_.reason() != wire::RunEnd::lease_lost) run_.set_reason(wire::RunEnd::faulted);
    end_run(now);
  }

  void take_reports() {
    engine_.settle_trigger();
    auto& reports = engine_.reports();
    while (const MotionReport* report = reports.front()) {
      if (outbox_.room() < Outbox::kSlots / 2) break;
      run_.take(*report, program());
      if ((report->flags & MotionEvent::kEnd) != 0) end(report->tick);
      reports.pop();
    }
    const std::uint32_t lost = engine_.take_lost();
    events_lost_ += lost;
    if (lost > 0 && safety_.in_run()) stop_for(wire::Fault::event_overflow, wire::RunEnd::faulted);
  }
  /// Everything planned has been done.
  void end(Ticks tick) {
    using enum wire::State;
    if (fault_at_rest_ != wire::Fault::none && moving()) {
      latch(fault_at_rest_);
    } else if (safety_.in_run()) {
      end_run(tick);
    } else if (safety_.state() == homing) {
      end_homing_stage();
    } else if (safety_.state() == jogging) {
      come_to_rest(safety_.position_known() ? homed : unhomed);
    }
  }
  void end_homing_stage() {
    using Outcome = typename HomingSequence<B>::Outcome;
    switch (homing_.end_stage()) {
      case Outcome::going_on:
        return;
      case Outcome::homed:
        return come_to_rest(wire::State::homed);
      case Outcome::stopped:
        return come_to_rest(wire::State::unhomed);
      case Outcome::not_found:
        return latch(wire::Fault::homing_failed);
      case Outcome::switch_stuck:
        return latch(wire::Fault::home_switch_stuck);
    }
  }
  void come_to_rest(wire::State state) {
    homing_.forget();
    release();
    become(state);
  }
  void end_run(Ticks tick) {
    release();
    engine_.drop_trigger();
    engine_.stop_sampling(tick);
    run_.end(tick, engine_.counters());
  }
  void release() {
    inputs_.watch(Watch::rest);
    lease_.release();
  }

  B& board_;
  Outbox& outbox_;
  BlackBox& black_box_;
  StepEngine<B> engine_;
  Safety safety_;
  ProgramStore store_;
  InputWatch<B> inputs_{board_, engine_, safety_};
  StepFeed<B> feed_{engine_};
  HomingSequence<B> homing_{board_, engine_, feed_, inputs_, store_};
  RunRecord run_{outbox_};
  Lease lease_;
  wire::Fault fault_at_rest_ = wire::Fault::none;
  std::uint32_t events_lost_ = 0;
  bool motor_enabled_ = false;
  bool estop_seen_ = false;
  bool stays_faulted_ = false;
};

}  // namespace diastole::firmware
