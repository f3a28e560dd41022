#pragma once
// What can be wrong with the simulated instrument, and when; times on the instrument's own clock.

#include <cstdint>
#include <limits>

namespace diastole::sim_daq {

/// Half-open span of time; empty by default.
struct FaultWindow {
  static FaultWindow always() { return {0, std::numeric_limits<uint64_t>::max()}; }
  uint64_t from_ns = std::numeric_limits<uint64_t>::max();
  uint64_t until_ns = std::numeric_limits<uint64_t>::max();
  [[nodiscard]] bool holds(uint64_t now_ns) const { return now_ns >= from_ns && now_ns < until_ns; }
};

struct DaqFaults {
  FaultWindow stall{};  ///< requests are swallowed
  FaultWindow drop{};   ///< connections are closed, new ones closed at once
  FaultWindow delay{};  ///< replies come delay_ns late
  uint64_t delay_ns = 0;
  bool refuse = false;       ///< answers with exception 11: the target device failed to respond
  bool cut_short = false;    ///< sends half an answer, then closes the connection
  bool stuck = false;        ///< the inputs' registers keep their values
  double timer_ahead_s = 0;  ///< of CORE_TIMER
};

}  // namespace diastole::sim_daq
