#pragma once
// When the run and its first trigger began, on the rig's clock. The start of run is the zero of a run file's times; the
// controller announces it 20 ms ahead (StateChanged) and confirms it to the tick (RunStarted), and both are overheard
// on the serial line. A later run begins anew.

#include <cstdint>
#include <optional>
#include <span>

#include "firmware/core/units.hpp"
#include "protocol/wire/frame.hpp"
#include "protocol/wire/messages.hpp"
#include "tools/sim_rig/fault_schedule.hpp"

namespace diastole::sim_rig {

class RunClock {
 public:
  /// The controller sends bytes, whether or not they arrive; its clock read 0 at tick_zero_ns.
  void observe(std::span<const uint8_t> bytes, uint64_t tick_zero_ns) {
    for (const uint8_t byte : bytes) {
      const auto frame = decoder_.push(byte);
      if (frame && frame->ok()) take(frame->value(), tick_zero_ns);
    }
  }
  void trigger(uint64_t time_ns) {
    if (!first_trigger_ns_) first_trigger_ns_ = time_ns;
  }

  /// A moment on the rig's clock, as soon as it is known. After the start of run, times are whole ticks of the
  /// controller, the first ns in each.
  [[nodiscard]] std::optional<uint64_t> at_ns(const Moment& moment) const {
    const bool has_to_come = moment.run > runs_, is_past = moment.run != 0 && moment.run < runs_;
    if (moment.origin != Origin::rig && has_to_come) return std::nullopt;
    if (moment.origin != Origin::rig && is_past) return 0;
    switch (moment.origin) {
      case Origin::rig:
        return moment.after_ns;
      case Origin::ttl:
        return first_trigger_ns_ ? std::optional(*first_trigger_ns_ + moment.after_ns) : std::nullopt;
      case Origin::run:
        return start_ ? std::optional(start_->tick_zero_ns + ns_of(start_->tick + ticks_of(moment.after_ns)))
                      : std::nullopt;
    }
    return std::nullopt;
  }
  /// The run that is on, or else the one that comes next; counted from 1.
  [[nodiscard]] uint32_t present_or_next_run() const { return over_ ? runs_ + 1 : runs_; }
  /// The start of run in ns; none before a run.
  [[nodiscard]] std::optional<uint64_t> run_start_ns() const { return at_ns({Origin::run, 0}); }

 private:
  static constexpr uint64_t ticks_per_us = firmware::kTicksPerMicrosecond;
  static constexpr uint64_t start_lead_ticks = 20'000 * ticks_per_us;

  /// The first ns of a tick.
  static constexpr uint64_t ns_of(uint64_t tick) {
    const uint64_t rest = tick % ticks_per_us;
    return tick / ticks_per_us * 1000 + (rest * 1000 + ticks_per_us - 1) / ticks_per_us;
  }

  /// The nearest tick.
  static constexpr uint64_t ticks_of(uint64_t ns) {
    return ns / 1000 * ticks_per_us + (ns % 1000 * ticks_per_us + 500) / 1000;
  }

  void take(const wire::Frame& frame, uint64_t tick_zero_ns) {
    if (frame.header.kind == wire::FrameKind::closed) over_ = true;  // it was reset
    if (frame.header.kind != wire::FrameKind::sequenced) return;
    if (frame.header.type == static_cast<uint8_t>(wire::StateChanged::kType)) {
      const auto message = wire::decode<wire::StateChanged>(frame.payload);
      if (!message.ok()) return;
      if (message->to == wire::State::running) {
        start_ = {message->tick + start_lead_ticks, tick_zero_ns};
        first_trigger_ns_.reset();
        ++runs_;
      }
      over_ = message->to != wire::State::running && message->to != wire::State::stopping;
    }
    if (frame.header.type == static_cast<uint8_t>(wire::RunStarted::kType)) {
      const auto message = wire::decode<wire::RunStarted>(frame.payload);
      if (message.ok()) start_ = {message->tick, tick_zero_ns};
    }
  }

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
