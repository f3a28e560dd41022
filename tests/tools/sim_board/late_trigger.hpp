#pragma once
// Three cycles of a hold with delayed triggers, run by the real image and disturbed about the beginning of the second: a debugger
// holds the core, so that its trigger's compare value is written late; or the core stands still between two stores.

#include <cmath>
#include <cstdint>
#include <vector>

#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/miniature_host.hpp"
#include "tools/sim_board/emulated_controller.hpp"

namespace diastole::sim_board_test {

struct HeldTriggers {
  static constexpr uint32_t cycles = 3, delay_us = 100;  ///< the least that the firmware takes
  static constexpr uint64_t period_ns = 400'000'000;

  bool ended = false;
  std::vector<uint64_t> rises_ns;       ///< of the TTL, at the pin
  std::vector<wire::Trigger> triggers;  ///< as reported
  uint32_t counted = 0;                 ///< by RunEnded

  /// Of the second trigger, behind its plan.
  [[nodiscard]] int64_t late_ns() const {
    return static_cast<int64_t>(rises_ns.at(1) - rises_ns.at(0)) - static_cast<int64_t>(period_ns);
  }
  /// Every rise at the pin is counted and reported once, with its own time.
  [[nodiscard]] bool reported() const {
    if (!ended || counted != rises_ns.size() || triggers.size() != rises_ns.size()) return false;
    for (std::size_t i = 1; i < rises_ns.size(); ++i) {
      const double at_pin_ns = static_cast<double>(rises_ns[i] - rises_ns[0]);
      const double reported_ns = static_cast<double>(triggers[i].tick - triggers[0].tick) * 1000 / 84;
      if (std::abs(at_pin_ns - reported_ns) > capture_ns) return false;
    }
    return true;
  }

 private:
  /// Two or three ticks of 84 MHz until TIM5 has captured, and one in each of the two differences.
  static constexpr double capture_ns = 60;
};

/// `disturb(board, pass)` comes `before_ns` before the second cycle begins; pass(time_ns) lets the board go on.
template <class Disturb>
HeldTriggers run_disturbed(uint64_t before_ns, const Disturb& disturb) {
  HeldTriggers found;
  EmulatedController controller({read_image(firmware)});
  MiniatureHost host(controller);
  wire::AddSegment hold = wire::AddSegment::example();
  hold.waveform = wire::Waveform::hold;
  hold.cycles = HeldTriggers::cycles;
  hold.stroke_nL = 5'000'000;
  hold.offset_nL = 1'000'000;
  hold.period_us = HeldTriggers::period_ns / 1000;
  wire::Arm arm = wire::Arm::example();
  arm.trigger_delay_us = HeldTriggers::delay_us;
  wire::Start start{};
  start.lease_id = MiniatureHost::lease;
  if (!host.prepare() || !host.ask(hold)) return found;
  host.edges.clear();
  if (!host.ask(arm) || !host.ask(start)) return found;
  const auto rises = [&host] {
    std::vector<uint64_t> times_ns;
    for (const sim_controller::PinEdge& edge : host.edges)
      if (edge.pin == sim_controller::Pin::ttl && edge.value == 1) times_ns.push_back(edge.time_ns);
    return times_ns;
  };
  if (!host.run_until([&] { return !rises().empty(); }, 30'000'000'000)) return found;
  const uint64_t slice_ns = host.slice_ns;
  const auto run_to = [&](uint64_t time_ns) {
    host.run_until([&] { return host.now_ns() + slice_ns > time_ns; }, 10'000'000'000);
    host.slice_ns = time_ns - host.now_ns();
    host.run_for(host.slice_ns);
    host.slice_ns = slice_ns;
  };
  run_to(rises().front() - uint64_t{HeldTriggers::delay_us} * 1000 + HeldTriggers::period_ns - before_ns);
  disturb(controller.board(), [&](uint64_t time_ns) { run_to(host.now_ns() + time_ns); });
  found.ended = host.run_until([&] { return host.ended.has_value(); }, 10'000'000'000);
  host.run_for(100'000'000);
  found.rises_ns = rises();
  found.triggers = host.triggers;
  found.counted = host.ended ? host.ended->triggers : 0;
  return found;
}

/// Held from `before_ns` before the second cycle begins, for `held_ns`.
inline HeldTriggers run_with_held_core(uint64_t before_ns, uint64_t held_ns) {
  return run_disturbed(before_ns, [held_ns](SimBoard& board, const auto& pass) {
    board.hold_core(true);
    pass(held_ns);
    board.hold_core(false);
  });
}

/// The core stands still behind the second cycle's first store to the register at `address`, for `stalled_ns`.
inline HeldTriggers run_with_stalled_store(uint32_t address, uint64_t stalled_ns) {
  constexpr uint64_t before_ns = 20'000;
  return run_disturbed(before_ns,
                       [=](SimBoard& board, const auto&) { board.stall_after_store(address, stalled_ns); });
}

}  // namespace diastole::sim_board_test
