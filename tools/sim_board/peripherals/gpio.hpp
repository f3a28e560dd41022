#pragma once
// GPIO ports A ... I: mode, output and set/reset registers, inputs with pulls, alternate functions.
// The level of a pin is what a wire on it would carry; changes go to the pin log.

#include <array>
#include <cstdint>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/pins.hpp"

namespace diastole::board_model {

/// Where an alternate-function pin gets its level: a timer output (TIM1 ... TIM14, channel 1 ... 4).
struct TimerOutput {
  uint8_t timer = 0, channel = 0;
};

/// The timer output that alternate function `function` of `pin` selects (datasheet, table 9); timer 0: none.
TimerOutput timer_output(Pin pin, uint32_t function);

class Gpio final : public RegisterBlock {
 public:
  Gpio(uint8_t port, const Clock& clock, PinLog& log);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;

  /// The outside world drives the pin; it keeps doing so through resets.
  void drive(uint8_t number, bool level, Cycles at);
  /// A timer output changed to `level`.
  void timer_level(TimerOutput output, bool level, Cycles at);

 private:
  uint32_t* word(uint32_t offset) override;
  [[nodiscard]] uint32_t mode(uint32_t number) const { return moder_ >> (2 * number) & 3; }
  [[nodiscard]] uint32_t function(uint32_t number) const {
    return alternate_[number / 8] >> (4 * (number % 8)) & 0xf;
  }
  [[nodiscard]] bool level_of(uint32_t number) const;
  void update(uint32_t number, Cycles at);
  void set_output(uint32_t value);
  void configured();

  uint8_t port_;
  const Clock& clock_;
  PinLog& log_;
  uint32_t moder_ = 0, otyper_ = 0, ospeedr_ = 0, pupdr_ = 0, odr_ = 0, lckr_ = 0;
  std::array<uint32_t, 2> alternate_{};
  std::array<int8_t, pins_per_port> driven_{};          ///< -1: not driven from outside
  std::array<TimerOutput, pins_per_port> sources_{};    ///< of pins in alternate mode
  std::array<std::array<bool, 5>, 15> timer_levels_{};  ///< by timer and channel number
};

}  // namespace diastole::board_model
