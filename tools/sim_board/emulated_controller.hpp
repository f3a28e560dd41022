#pragma once
// The firmware's image on the emulated board, wired to the rig's switches: stands wherever the host-built
// controller does (sim_controller::SimulatedController), and is what program sim_board runs.
//
// The carriage's switches follow the steps made: the home switch is closed at and below 0 microsteps, the far
// limit from Mechanics::far_limit_microsteps on, as on firmware/boards/recording.

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "firmware/core/homing.hpp"
#include "tools/sim_board/core/pins.hpp"
#include "tools/sim_board/image_file.hpp"
#include "tools/sim_board/sim_board.hpp"
#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole {

/// A wire: its pin, and the level that means "active" (STEP high, motor enabled, switch closed ...).
struct Wire {
  board_model::Pin pin;
  bool active_high = true;
};

struct Wiring {
  Wire step, dir, enable, ttl, fault;  ///< outputs; DIR active is "inflate"
  Wire estop, home, far_limit;         ///< inputs; active is "pressed", "closed"
  uint8_t rwave_dac = 1;               ///< DAC channel
  uint32_t fault_number = 0;           ///< address of the byte that holds the number behind the FAULT pin
};

/// The board as firmware/boards/stm32f405/pins.hpp draws it.
const Wiring& diastole_wiring();

/// The event in the terms of a pin trace; nullopt for a pin that is not in it.
std::optional<sim_controller::PinEdge> pin_edge(const Wiring& wiring, const board_model::PinEvent& event);

struct Mechanics {
  int64_t parked_microsteps = 400;
  int64_t far_limit_microsteps = 2'000'000'000;
};

class EmulatedController final : public sim_controller::SimulatedController {
 public:
  /// Loads the images and powers the board on. Throws InputError when they do not fit the chip.
  explicit EmulatedController(const std::vector<Image>& images, Mechanics mechanics = {},
                              SimBoardOptions options = {})
      : mechanics_(mechanics), board_(options), position_(mechanics.parked_microsteps) {
    for (const Image& image : images) {
      for (const ImageSegment& segment : image.segments)
        board_.load(segment.bytes, segment.address);
    }
    drive(wiring_.estop, false, 0);
    drive(wiring_.home, position_ <= 0, 0);
    drive(wiring_.far_limit, position_ >= mechanics_.far_limit_microsteps, 0);
    board_.on_pin_change([this](SimBoard::Pin pin, bool level, uint64_t time_ns) {
      if (pin == wiring_.step.pin && level == wiring_.step.active_high) step(time_ns);
      if (pin == wiring_.fault.pin && level == wiring_.fault.active_high) note_fault();
    });
    board_.power_on();
  }

  [[nodiscard]] Places places() const override {
    return {mechanics_.parked_microsteps, 1 + int64_t{firmware::kHomeClearance_steps}};
  }
  /// The firmware's clock is TIM2, which it starts some time after power-on.
  [[nodiscard]] uint64_t tick_zero_ns() const override {
    constexpr uint64_t ticks_per_us = firmware::kTicksPerMicrosecond;
    const uint64_t ticks_since_power = (board_.now_ns() - powered_ns_) * ticks_per_us / 1000;
    const auto started_ticks = static_cast<uint32_t>(ticks_since_power - board_.timer_count(2));
    return powered_ns_ + uint64_t{started_ticks} * 1000 / ticks_per_us;
  }
  void receive(std::span<const uint8_t> bytes) override { board_.send(bytes); }
  Output advance_to(uint64_t until_ns) override {
    board_.advance_to(until_ns);
    sent_.clear();
    for (const SentByte& byte : board_.take_sent())
      sent_.push_back(byte.value);
    edges_.clear();
    for (const SimBoard::PinEvent& event : board_.take_pin_events()) {
      auto edge = pin_edge(wiring_, event);
      if (!edge) continue;
      if (edge->pin == sim_controller::Pin::fault && edge->value != 0 && !fault_numbers_.empty()) {
        edge->value = fault_numbers_.front();
        fault_numbers_.pop_front();
      }
      edges_.push_back(*edge);
    }
    return {sent_, edges_};
  }
  void hold_switch(sim_controller::Switch which, bool active) override {
    const uint64_t now_ns = board_.now_ns();
    switch (which) {
      case sim_controller::Switch::estop:
        return press_estop(now_ns, active);
      case sim_controller::Switch::home:
        return close_home(now_ns, active || position_ <= 0);
      case sim_controller::Switch::far_limit:
        return close_far_limit(now_ns, active || position_ >= mechanics_.far_limit_microsteps);
    }
  }
  void set_power(bool on) override {
    if (on == board_.powered()) return;
    if (on) powered_ns_ = board_.now_ns();
    on ? board_.power_on() : board_.power_off();
  }

  void press_estop(uint64_t time_ns, bool pressed = true) { drive(wiring_.estop, pressed, time_ns); }
  void close_home(uint64_t time_ns, bool closed = true) { drive(wiring_.home, closed, time_ns); }
  void close_far_limit(uint64_t time_ns, bool closed = true) { drive(wiring_.far_limit, closed, time_ns); }

  [[nodiscard]] SimBoard& board() { return board_; }
  [[nodiscard]] int64_t position_microsteps() const { return position_; }

 private:
  void drive(const Wire& wire, bool active, uint64_t time_ns) {
    board_.drive(wire.pin, active == wire.active_high, time_ns);
  }
  /// The motor follows a step only while it has current.
  void step(uint64_t time_ns) {
    const auto active = [&](const Wire& wire) { return board_.level(wire.pin) == wire.active_high; };
    if (!active(wiring_.enable)) return;
    const int64_t before = position_;
    position_ += active(wiring_.dir) ? 1 : -1;
    if ((before <= 0) != (position_ <= 0)) drive(wiring_.home, position_ <= 0, time_ns);
    const int64_t far = mechanics_.far_limit_microsteps;
    if ((before >= far) != (position_ >= far)) drive(wiring_.far_limit, position_ >= far, time_ns);
  }
  /// The firmware writes the number before it raises the pin.
  void note_fault() {
    fault_numbers_.push_back(static_cast<int32_t>(board_.word(wiring_.fault_number).value_or(0) & 0xff));
  }

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
