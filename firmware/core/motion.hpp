#pragma once
// Everything that moves or may not move: program, planner, step engine, safety, lease, homing. Requests
// return Refusal::none or why not; what happens later is told through the outbox.
//
// on_match() and on_inputs() are called from interrupts, everything else from the main loop.

#include <atomic>
#include <optional>
#include <utility>

#include "firmware/core/black_box.hpp"
#include "firmware/core/board.hpp"
#include "firmware/core/homing.hpp"
#include "firmware/core/jog.hpp"
#include "firmware/core/lease.hpp"
#include "firmware/core/outbox.hpp"
#include "firmware/core/plan_check.hpp"
#include "firmware/core/planner.hpp"
#include "firmware/core/safety.hpp"
#include "firmware/core/step_engine.hpp"
#include "firmware/core/take_up.hpp"

namespace diastole::firmware {

template <Board B>
class Motion {
 public:
  /// Steps are handed to the engine this long before their time; a main loop that stalls longer is an
  /// underrun.
  static constexpr Ticks kHorizon = microseconds(10'000);
  /// From the order to move to the first event.
  static constexpr Ticks kStartLead = microseconds(20'000);

  Motion(B& board, Outbox& outbox, BlackBox& black_box)
      : board_(board), outbox_(outbox), black_box_(black_box), engine_(board) {}

  // Requests (main loop).
  /// Geometry and limits; refused where they disagree with machine settings that were ever written.
  PlanRefusal configure(const wire::Configure& configure);
  /// Settings from flash; `written` unless they are the initial ones. What was configured is forgotten, and so
  /// is the position: its unit may have changed.
  void use(const wire::MachineSettings& machine, bool written);
  wire::Refusal clear_program();
  wire::Refusal add_segment(const wire::AddSegment& add);
  wire::Refusal upload(const wire::UploadWaveform& upload);
  wire::Refusal upload(const wire::WaveformPoints& points);
  /// Checks the program; its segments are reported in the following turns; PlanRefusal{none} if it is
  /// accepted.
  PlanRefusal arm(const wire::Arm& arm);
  wire::Refusal home(std::uint32_t lease_id);
  /// Unhomed or homed; the first limit that it would exceed is told.
  PlanRefusal jog(const wire::Jog& jog);
  wire::Refusal start(std::uint32_t lease_id);
  wire::Refusal stop_at_cycle_end();
  wire::Refusal stop_now();
  wire::Refusal halt();
  wire::Refusal clear_fault();
  /// Takes the motor's current away; the position is then unknown. Precondition: at rest.
  void let_go();
  void heartbeat(std::uint32_t lease_id) { lease_.heartbeat(lease_id, board_.now()); }

  /// One turn of the main loop: faults, lease, homing, refilling the queue, reports.
  void poll();

  // Interrupts.
  void on_match() { engine_.on_match(); }
  void on_inputs();

  [[nodiscard]] const Safety& safety() const { return safety_; }
  [[nodiscard]] StepEngine<B>& engine() { return engine_; }
  [[nodiscard]] const StepEngine<B>& engine() const { return engine_; }
  [[nodiscard]] const Program& program() const { return program_; }
  [[nodiscard]] std::uint16_t segment() const { return segment_; }
  [[nodiscard]] std::uint32_t events_lost() const { return events_lost_ + outbox_.lost(); }
  [[nodiscard]] bool motor_enabled() const { return motor_enabled_; }
  /// A run's last event has been seen: send what is left of its positions, then call report_run_end().
  [[nodiscard]] bool run_end_due() const { return run_end_due_.has_value(); }
  void report_run_end();
  /// Tick of the start of the present or last run.
  [[nodiscard]] Ticks run_start() const { return run_start_; }

 private:
  /// What the input interrupt has to watch for.
  enum class Watch : std::uint8_t {
    rest,
    run,
    approach_home,
    leave_home,
    inflating,
    withdrawing,
    withdrawing_from_far
  };

  /// An interrupt has cut the motion off and the main loop has not latched the fault yet.
  [[nodiscard]] bool fault_pending() const { return tripped_ != wire::Fault::none; }
  [[nodiscard]] wire::Refusal program_open() const;
  void become(wire::State to);
  void tell_state(wire::State from, wire::State to);
  void latch(wire::Fault fault);
  void trip(wire::Fault fault);
  void take_tripped_fault();
  void note_estop();
  void set_motor_enabled(bool enabled);
  void watch_lease();
  void begin_controlled_stop(wire::RunEnd reason);
  [[nodiscard]] bool homing_or_jogging() const;
  /// At rest within the lease at up to Settings::hand_steps_per_s.
  [[nodiscard]] Ticks hand_silence() const {
    return microseconds(settings_.limits().lease_us / 4 * 3 - 5'000) - kHorizon;
  }
  void run_homing();
  void begin_homing_stage(HomingStage stage);
  void end_homing_stage();
  void come_to_rest(wire::State state);
  void report_plan();
  void take_reports();
  void take_report(const MotionReport& report);
  void take_end(Ticks tick);
  void end_motion(Ticks tick);
  void refill();
  void refill_taking_up(Ticks until);
  void begin_taking_up(Ticks window, Ticks start);

  B& board_;
  Outbox& outbox_;
  BlackBox& black_box_;
  StepEngine<B> engine_;
  Planner planner_;
  WaveformStore waveforms_;
  Program program_;
  wire::MachineSettings machine_;
  bool machine_written_ = false;
  std::uint32_t backlash_steps_ = 0;
  TakeUp take_up_;
  Ticks take_up_window_;    ///< of the armed program
  bool taking_up_ = false;  ///< the present motion takes up play
  Settings settings_;
  bool configured_ = false;
  Safety safety_;
  Lease lease_;
  Ticks silence_allowed_;
  HomingStage homing_ = HomingStage::done;
  std::atomic<Watch> watch_{Watch::rest};
  std::atomic<wire::Fault> tripped_{wire::Fault::none};
  bool motor_enabled_ = false;
  bool estop_seen_ = false;
  bool decelerating_ = false;
  wire::RunEnd end_reason_ = wire::RunEnd::completed;
  std::optional<wire::RunEnded> run_end_due_;
  wire::Fault fault_at_rest_ = wire::Fault::none;
  std::size_t next_planned_ = 0;  ///< segment whose SegmentPlanned is due
  std::uint16_t segment_ = 0;
  std::uint16_t next_segment_ = 0;
  std::uint32_t next_cycle_ = 0;
  std::uint32_t triggers_before_ = 0;
  std::uint32_t r_waves_before_ = 0;
  std::uint32_t events_lost_ = 0;
  Ticks run_start_;
};

}  // namespace diastole::firmware

#include "firmware/core/motion_requests.hpp"
#include "firmware/core/motion_turn.hpp"
