#pragma once
// GPIO ports A ... I: mode, output and set/reset registers, inputs with pulls, alternate functions.
// The level of a pin is what a wire on it would carry; changes go to the pin log.

#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/pins.hpp"

namespace diastole::board_model {

/// Where an alternate-function pin gets its level, or brings it: a timer's channel (TIM1 ... TIM14, channel 1 ... 4).
struct TimerOutput {
  uint8_t timer = 0, channel = 0;
};

class Gpio final : public RegisterBlock {
 public:
  Gpio(uint8_t port, const Clock& clock, PinLog& log) : port_(port), clock_(clock), log_(log) {
    driven_.fill(-1);
    shorted_.fill(-1);
    reset();
  }

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset != 0x10) return RegisterBlock::read(offset);
    uint32_t levels = 0;
    for (uint8_t number = 0; number < pins_per_port; ++number) {
      if (mode(number) != analog && log_.level({port_, number})) levels |= 1U << number;
    }
    return levels;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    const uint32_t bits = value & mask;
    if (offset == 0x14) return set_output(merged(odr_, value, mask) & 0xffff);
    if (offset == 0x18) return set_output((odr_ & ~(bits >> 16)) | (bits & 0xffff));  // set wins over reset
    RegisterBlock::write(offset, value, mask);
    configured();
  }
  void reset() override {
    moder_ = mode_after_reset(port_);
    pupdr_ = pulls_after_reset(port_);
    ospeedr_ = port_ == 0 ? 0x0c00'0000 : port_ == 1 ? 0xc0 : 0;  // the debug pins
    otyper_ = odr_ = lckr_ = 0;
    alternate_.fill(0);
    configured();
  }

  /// The outside world drives the pin; it keeps doing so through resets.
  void drive(uint8_t number, bool level, Cycles at) {
    driven_[number] = level ? 1 : 0;
    update(number, at);
  }
  /// A short holds the pin at a level, whatever drives it and through resets; nullopt: no more.
  void short_to(uint8_t number, std::optional<bool> level, Cycles at) {
    shorted_[number] = level ? static_cast<int8_t>(*level) : int8_t{-1};
    update(number, at);
  }
  /// A timer's channel takes its pin's level, or gives it again.
  void timer_direction(TimerOutput of, bool is_input, Cycles at) {
    timer_inputs_[of.timer][of.channel] = is_input;
    update_those_of(of, at);
  }
  /// The timer channel that the pin leads to, by its alternate function; timer 0: none.
  [[nodiscard]] TimerOutput timer_of(uint8_t number) const { return sources_[number]; }
  [[nodiscard]] bool is_analog(uint8_t number) const { return mode(number) == analog; }
  /// A timer output changed to `level`.
  void timer_level(TimerOutput from, bool level, Cycles at) {
    timer_levels_[from.timer][from.channel] = level;
    update_those_of(from, at);
  }

 private:
  enum Mode : uint32_t { input = 0, output = 1, alternate = 2, analog = 3 };

  struct Route {
    char port;
    uint8_t number, function, timer, channel;
  };

  static constexpr Route routes[] = {
      {'A', 0, 1, 2, 1},  {'A', 0, 2, 5, 1},  {'A', 1, 1, 2, 2},  {'A', 1, 2, 5, 2},   {'A', 2, 1, 2, 3},
      {'A', 2, 2, 5, 3},  {'A', 2, 3, 9, 1},  {'A', 3, 1, 2, 4},  {'A', 3, 2, 5, 4},   {'A', 3, 3, 9, 2},
      {'A', 5, 1, 2, 1},  {'A', 6, 2, 3, 1},  {'A', 6, 9, 13, 1}, {'A', 7, 2, 3, 2},   {'A', 7, 9, 14, 1},
      {'A', 8, 1, 1, 1},  {'A', 9, 1, 1, 2},  {'A', 10, 1, 1, 3}, {'A', 11, 1, 1, 4},  {'A', 15, 1, 2, 1},
      {'B', 0, 2, 3, 3},  {'B', 1, 2, 3, 4},  {'B', 3, 1, 2, 2},  {'B', 4, 2, 3, 1},   {'B', 5, 2, 3, 2},
      {'B', 6, 2, 4, 1},  {'B', 7, 2, 4, 2},  {'B', 8, 2, 4, 3},  {'B', 8, 3, 10, 1},  {'B', 9, 2, 4, 4},
      {'B', 9, 3, 11, 1}, {'B', 10, 1, 2, 3}, {'B', 11, 1, 2, 4}, {'B', 14, 9, 12, 1}, {'B', 15, 9, 12, 2},
      {'C', 6, 2, 3, 1},  {'C', 6, 3, 8, 1},  {'C', 7, 2, 3, 2},  {'C', 7, 3, 8, 2},   {'C', 8, 2, 3, 3},
      {'C', 8, 3, 8, 3},  {'C', 9, 2, 3, 4},  {'C', 9, 3, 8, 4},  {'D', 12, 2, 4, 1},  {'D', 13, 2, 4, 2},
      {'D', 14, 2, 4, 3}, {'D', 15, 2, 4, 4}, {'E', 5, 3, 9, 1},  {'E', 6, 3, 9, 2},   {'E', 9, 1, 1, 1},
      {'E', 11, 1, 1, 2}, {'E', 13, 1, 1, 3}, {'E', 14, 1, 1, 4},
  };

  /// The timer output that alternate function `function` of `pin` selects (datasheet, table 9); timer 0: none.
  static TimerOutput timer_output(Pin pin, uint32_t function) {
    for (const Route& route : routes) {
      if (route.port - 'A' == pin.port && route.number == pin.number && route.function == function)
        return {route.timer, route.channel};
    }
    return {};
  }

  static uint32_t mode_after_reset(uint8_t port) { return port == 0 ? 0xa800'0000 : port == 1 ? 0x280 : 0; }
  static uint32_t pulls_after_reset(uint8_t port) { return port == 0 ? 0x6400'0000 : port == 1 ? 0x100 : 0; }

  uint32_t* word(uint32_t offset) override {
    return in_order(offset, {&moder_, &otyper_, &ospeedr_, &pupdr_, nullptr, &odr_, nullptr, &lckr_,
                             &alternate_[0], &alternate_[1]});
  }
  [[nodiscard]] uint32_t mode(uint32_t number) const { return moder_ >> (2 * number) & 3; }
  [[nodiscard]] uint32_t function(uint32_t number) const {
    return alternate_[number / 8] >> (4 * (number % 8)) & 0xf;
  }
  [[nodiscard]] bool level_of(uint32_t number) const {
    if (shorted_[number] >= 0) return shorted_[number] == 1;
    const uint32_t pull = pupdr_ >> (2 * number) & 3;
    const bool rest = driven_[number] >= 0 ? driven_[number] == 1 : pull == 1;
    switch (mode(number)) {
      case output: {
        const bool high = (odr_ >> number & 1) != 0;
        const bool open_drain = (otyper_ >> number & 1) != 0;
        return high && open_drain ? rest : high;
      }
      case alternate: {
        const TimerOutput source = sources_[number];
        const bool gives = source.timer != 0 && !timer_inputs_[source.timer][source.channel];
        return gives ? timer_levels_[source.timer][source.channel] : rest;
      }
      default:
        return rest;
    }
  }
  void update_those_of(TimerOutput channel, Cycles at) {
    for (uint8_t number = 0; number < pins_per_port; ++number) {
      const TimerOutput source = sources_[number];
      if (source.timer == channel.timer && source.channel == channel.channel) update(number, at);
    }
  }
  void update(uint32_t number, Cycles at) {
    log_.set_level({port_, static_cast<uint8_t>(number)}, level_of(number), at);
  }
  void set_output(uint32_t value) {
    uint32_t changed = odr_ ^ value;
    odr_ = value;
    for (; changed != 0; changed &= changed - 1) {
      update(static_cast<uint32_t>(std::countr_zero(changed)), clock_.now());
    }
  }
  void configured() {
    for (uint8_t number = 0; number < pins_per_port; ++number) {
      sources_[number] =
          mode(number) == alternate ? timer_output({port_, number}, function(number)) : TimerOutput{};
      update(number, clock_.now());
    }
  }

  uint8_t port_;
  const Clock& clock_;
  PinLog& log_;
  uint32_t moder_ = 0, otyper_ = 0, ospeedr_ = 0, pupdr_ = 0, odr_ = 0, lckr_ = 0;
  std::array<uint32_t, 2> alternate_{};
  std::array<int8_t, pins_per_port> driven_{}, shorted_{};               ///< -1: not from outside
  std::array<TimerOutput, pins_per_port> sources_{};                     ///< of pins in alternate mode
  std::array<std::array<bool, 5>, 15> timer_levels_{}, timer_inputs_{};  ///< by timer and channel number
};

}  // namespace diastole::board_model
