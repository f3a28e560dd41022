#include "tools/sim_rig/run_clock.hpp"

#include "firmware/core/units.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole::sim_rig {
namespace {

constexpr uint64_t ticks_per_us = firmware::kTicksPerMicrosecond;
constexpr uint64_t start_lead_ticks = 20'000 * ticks_per_us;

/// The first ns of a tick.
constexpr uint64_t ns_of(uint64_t tick) {
  const uint64_t rest = tick % ticks_per_us;
  return tick / ticks_per_us * 1000 + (rest * 1000 + ticks_per_us - 1) / ticks_per_us;
}

/// The nearest tick.
constexpr uint64_t ticks_of(uint64_t ns) {
  return ns / 1000 * ticks_per_us + (ns % 1000 * ticks_per_us + 500) / 1000;
}

}  // namespace

void RunClock::overhear(std::span<const uint8_t> bytes, uint64_t tick_zero_ns) {
  for (const uint8_t byte : bytes) {
    const auto frame = decoder_.push(byte);
    if (frame && frame->ok()) take(frame->value(), tick_zero_ns);
  }
}

void RunClock::take(const wire::Frame& frame, uint64_t tick_zero_ns) {
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

void RunClock::trigger(uint64_t time_ns) {
  if (!first_trigger_ns_) first_trigger_ns_ = time_ns;
}

std::optional<uint64_t> RunClock::at_ns(const Moment& moment) const {
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

}  // namespace diastole::sim_rig
