#pragma once
// The firmware's image on the emulated board, wired to the rig's switches: stands wherever the host-built
// controller does (sim_controller::SimulatedController), and is what program sim_board runs.
//
// The carriage's switches follow the steps made: the home switch is closed at and below 0 microsteps, the far
// limit from Mechanics::far_limit_microsteps on, as on firmware/boards/recording.

#include <cstdint>
#include <deque>
#include <vector>

#include "tools/sim_board/image_file.hpp"
#include "tools/sim_board/sim_board.hpp"
#include "tools/sim_board/wiring.hpp"
#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole {

struct Mechanics {
  int64_t parked_microsteps = 400;
  int64_t far_limit_microsteps = 2'000'000'000;
};

class EmulatedController final : public sim_controller::SimulatedController {
 public:
  /// Loads the images and powers the board on. Throws InputError when they do not fit the chip.
  explicit EmulatedController(const std::vector<Image>& images, Mechanics mechanics = {},
                              SimBoardOptions options = {});

  [[nodiscard]] Places places() const override;
  [[nodiscard]] uint64_t tick_zero_ns() const override;
  void receive(std::span<const uint8_t> bytes) override { board_.send(bytes); }
  Output advance_to(uint64_t until_ns) override;
  void hold_switch(sim_controller::Switch which, bool active) override;
  void set_power(bool on) override;

  void press_estop(uint64_t time_ns, bool pressed = true);
  void close_home(uint64_t time_ns, bool closed = true) { drive(wiring_.home, closed, time_ns); }
  void close_far_limit(uint64_t time_ns, bool closed = true) { drive(wiring_.far_limit, closed, time_ns); }

  [[nodiscard]] SimBoard& board() { return board_; }
  [[nodiscard]] int64_t position_microsteps() const { return position_; }

 private:
  void drive(const Wire& wire, bool active, uint64_t time_ns);
  void step(uint64_t time_ns);
  void note_fault();

  const Wiring& wiring_ = diastole_wiring();
  Mechanics mechanics_;
  SimBoard board_;
  int64_t position_;
  uint64_t powered_ns_ = 0;
  std::deque<int32_t> fault_numbers_;  ///< of rises of FAULT that advance_to() has not handed over
  std::vector<uint8_t> sent_;
  std::vector<sim_controller::PinEdge> edges_;
};

}  // namespace diastole
