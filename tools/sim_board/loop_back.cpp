#include "tools/sim_board/loop_back.hpp"

#include <algorithm>
#include <memory>

namespace diastole {
namespace {

constexpr board_model::Pin step_input{0, 3}, ttl_input{0, 5}, r_wave_input{2, 3};

}  // namespace

void connect_loop_back(SimBoard& board, const LoopBack& wires) {
  const Wiring& wiring = diastole_wiring();
  const auto steps = std::make_shared<uint64_t>(0), ttls = std::make_shared<uint64_t>(0);
  const auto lost = [wires, steps](bool rises) {
    if (rises) ++*steps;
    return wires.lost_step != 0 && *steps == wires.lost_step;
  };
  const auto jitter_ns = [](uint64_t pulse, uint64_t most_ns) { return pulse % 2 == 0 ? most_ns : 0; };
  board.on_pin_change([=, &board, &wiring](SimBoard::Pin pin, bool level, uint64_t time_ns) {
    if (wires.step && pin == wiring.step.pin && !lost(level))
      board.drive(step_input, level, time_ns + wires.step_delay_ns + jitter_ns(*steps, wires.step_jitter_ns));
    if (!wires.ttl || pin != wiring.ttl.pin) return;
    if (level) ++*ttls;
    const uint64_t at_ns = time_ns + wires.ttl_delay_ns + jitter_ns(*ttls, wires.ttl_jitter_ns);
    board.drive(ttl_input, level, at_ns);
    if (!wires.ttl_bounces || !level) return;
    board.drive(ttl_input, false, at_ns + 500);
    board.drive(ttl_input, true, at_ns + 1'000);
  });
  if (!wires.r_wave) return;
  board.drive_analog(r_wave_input, [&board, wires](uint64_t time_ns) {
    const double volts = board.dac_V(1, time_ns - std::min(time_ns, wires.r_wave_delay_ns));
    return wires.r_wave_gain * volts + wires.r_wave_offset_V;
  });
}

}  // namespace diastole
