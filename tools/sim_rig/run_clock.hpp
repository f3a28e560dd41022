#pragma once
// When the run and its first trigger began, on the rig's clock. The start of run is the zero of a run file's times; the
// controller announces it 20 ms ahead (StateChanged) and confirms it to the tick (RunStarted), and both are overheard
// on the serial line. A later run begins anew.

#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/frame.hpp"
#include "tools/sim_rig/fault_schedule.hpp"

namespace diastole::sim_rig {

class RunClock {
 public:
  /// The controller sends bytes, whether or not they arrive; its clock read 0 at tick_zero_ns.
  void overhear(std::span<const uint8_t> bytes, uint64_t tick_zero_ns);
  void trigger(uint64_t time_ns);

  /// A moment on the rig's clock, as soon as it is known. After the start of run, times are whole ticks of the
  /// controller, the first ns in each.
  [[nodiscard]] std::optional<uint64_t> at_ns(const Moment& moment) const;
  /// The run that is on, or else the one that comes next; counted from 1.
  [[nodiscard]] uint32_t present_or_next_run() const { return over_ ? runs_ + 1 : runs_; }
  /// The start of run in ns; none before a run.
  [[nodiscard]] std::optional<uint64_t> run_start_ns() const { return at_ns({Origin::run, 0}); }

 private:
  void take(const wire::Frame& frame, uint64_t tick_zero_ns);

  wire::FrameDecoder decoder_;
  struct Start {
    uint64_t tick = 0;
    uint64_t tick_zero_ns = 0;
  };
  std::optional<Start> start_;
  uint32_t runs_ = 0;  ///< begun so far
  bool over_ = true;   ///< the latest of them
  std::optional<uint64_t> first_trigger_ns_;
};

}  // namespace diastole::sim_rig
