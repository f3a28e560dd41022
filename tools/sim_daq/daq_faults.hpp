#pragma once
// What can be wrong with the simulated instrument, and when; times on the instrument's own clock.

#include <cstdint>
#include <limits>

namespace diastole::sim_daq {

/// Half-open span of time; empty by default.
struct FaultWindow {
  uint64_t from_ns = std::numeric_limits<uint64_t>::max();
  uint64_t until_ns = std::numeric_limits<uint64_t>::max();
  [[nodiscard]] bool holds(uint64_t now_ns) const { return now_ns >= from_ns && now_ns < until_ns; }
  [[nodiscard]] bool empty() const { return from_ns >= until_ns; }
  [[nodiscard]] FaultWindow later_by(uint64_t ns) const { return {from_ns + ns, until_ns + ns}; }
};

struct DaqFaults {
  FaultWindow stall{};  ///< requests are swallowed
  FaultWindow drop{};   ///< connections are closed, new ones closed at once
  FaultWindow delay{};  ///< replies come delay_ns late
  uint64_t delay_ns = 0;
};

}  // namespace diastole::sim_daq
