#pragma once
// A session that is held twice, with the firmware built for this machine and with its image on the emulated
// board, and whose pin edges are compared tick for tick. A new one is a row in scenario_list.cpp.

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <string>
#include <vector>

#include "protocol/wire/messages.hpp"
#include "tests/tools/sim_board/miniature_host.hpp"
#include "tests/tools/sim_board/scenario_rig.hpp"

namespace diastole::sim_board_test {

/// What happens to a motion under way.
enum class Act : uint8_t { none, estop, far_limit, stop_at_cycle_end, stop_now, halt, silence };

/// How late what is done may take effect on the emulated board, compared with the recording one. Inputs act by
/// interrupt: its latency behind others of the same priority. Requests travel as bytes and wait for the main loop
/// and for the next millisecond of the miniature host.
constexpr uint64_t latency_ns(Act act) {
  const bool input = act == Act::estop || act == Act::far_limit;
  return act == Act::none || act == Act::stop_at_cycle_end ? 0 : input ? 10'000 : 5'000'000;
}

struct Scenario {
  std::string name;
  std::vector<wire::AddSegment> program;
  uint16_t gate_every = 1;
  uint32_t trigger_delay_us = 0;
  Act act = Act::none;
  uint64_t act_after_ms = 0;  ///< of the motion's first edge
  /// Further requests before the program, such as the upload of a waveform.
  std::function<void(MiniatureHost&)> before = [](MiniatureHost&) {};
  /// Begins another motion than the program's run and waits for its end; stages between which the motor rests are
  /// each timed from their own first edge.
  std::function<void(MiniatureHost&)> motion = {};
  bool to_a_switch =
      false;  ///< stages end where a switch closes: how far beyond hangs on the main loop's turn
};
std::ostream& operator<<(std::ostream& out, const Scenario& scenario);

const std::vector<Scenario>& scenarios();

struct TimedEdge {
  int64_t tick;  ///< of 84 MHz, from the motion's first edge on STEP or TTL (or its stage's)
  sim_controller::Pin pin;
  int32_t value;
  bool operator==(const TimedEdge&) const = default;
};
std::ostream& operator<<(std::ostream& out, const TimedEdge& edge);

struct Motion {
  std::vector<TimedEdge> edges;     ///< STEP, DIR, TTL, in order
  std::vector<TimedEdge> wave;      ///< RWAVE_uV
  std::vector<TimedEdge> switches;  ///< ENABLE, FAULT
  int64_t end_microsteps = 0;
  wire::Fault fault = wire::Fault::none;
  std::optional<wire::RunEnd> reason;
};

/// The motion of the scenario; if it was disturbed, or was no run, then also, after clearing what is to be cleared
/// and homing, the program undisturbed.
struct Session {
  Motion motion;
  std::optional<Motion> again;
};
Session hold(const Scenario& scenario, ScenarioRig& rig);

}  // namespace diastole::sim_board_test
