#include "tools/sim_board/emulated_controller.hpp"

#include "firmware/core/homing.hpp"

namespace diastole {

EmulatedController::EmulatedController(const std::vector<Image>& images, Mechanics mechanics,
                                       SimBoardOptions options)
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

EmulatedController::Places EmulatedController::places() const {
  return {mechanics_.parked_microsteps, 1 + int64_t{firmware::kHomeClearance_steps}};
}

void EmulatedController::drive(const Wire& wire, bool active, uint64_t time_ns) {
  board_.drive(wire.pin, active == wire.active_high, time_ns);
}

void EmulatedController::press_estop(uint64_t time_ns, bool pressed) {
  drive(wiring_.estop, pressed, time_ns);
}

void EmulatedController::hold_switch(sim_controller::Switch which, bool active) {
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

void EmulatedController::set_power(bool on) {
  if (on == board_.powered()) return;
  if (on) powered_ns_ = board_.now_ns();
  on ? board_.power_on() : board_.power_off();
}

/// The firmware's clock is TIM2, which it starts some time after power-on.
uint64_t EmulatedController::tick_zero_ns() const {
  constexpr uint64_t ticks_per_us = firmware::kTicksPerMicrosecond;
  const uint64_t ticks_since_power = (board_.now_ns() - powered_ns_) * ticks_per_us / 1000;
  const auto started_ticks = static_cast<uint32_t>(ticks_since_power - board_.timer_count(2));
  return powered_ns_ + uint64_t{started_ticks} * 1000 / ticks_per_us;
}

/// The motor follows a step only while it has current.
void EmulatedController::step(uint64_t time_ns) {
  const auto active = [&](const Wire& wire) { return board_.level(wire.pin) == wire.active_high; };
  if (!active(wiring_.enable)) return;
  const int64_t before = position_;
  position_ += active(wiring_.dir) ? 1 : -1;
  if ((before <= 0) != (position_ <= 0)) drive(wiring_.home, position_ <= 0, time_ns);
  const int64_t far = mechanics_.far_limit_microsteps;
  if ((before >= far) != (position_ >= far)) drive(wiring_.far_limit, position_ >= far, time_ns);
}

/// The firmware writes the number before it raises the pin.
void EmulatedController::note_fault() {
  fault_numbers_.push_back(static_cast<int32_t>(board_.word(wiring_.fault_number).value_or(0) & 0xff));
}

EmulatedController::Output EmulatedController::advance_to(uint64_t until_ns) {
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

}  // namespace diastole
