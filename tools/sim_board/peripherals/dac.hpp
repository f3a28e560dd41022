#pragma once
// DAC: two 12-bit channels, holding registers, triggers by timer, EXTI line 9 or software, and the triangle
// generator (RM0090, 14). Each change of an output code is logged; as a voltage it settles exponentially, to a code in the 3 µs
// that the datasheet calls typical.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/pins.hpp"

namespace diastole::board_model {

class Dac final : public RegisterBlock {
 public:
  Dac(const Clock& clock, PinLog& log, Notes& notes) : clock_(clock), log_(log), notes_(notes) { reset(); }

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset == 0x20) return channels_[0].holding | channels_[1].holding << 16;
    if (offset < first_holding || offset >= 0x20) return RegisterBlock::read(offset);
    const uint32_t holding = channels_[(offset - first_holding) / holding_registers].holding;
    const uint32_t form = (offset - first_holding) % holding_registers;
    return form == right_12 ? holding : form == left_12 ? holding << 4 : holding >> 4;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (offset == 0x00) {
      RegisterBlock::write(offset, value, mask);
      for (uint32_t channel = 0; channel < 2; ++channel) {
        if ((control(channel) & enabled) == 0) output(channel, 0, clock_.now());
        if ((control(channel) & 0xc0) == 0) channels_[channel].triangle = 0;
        if ((control(channel) & 0xc0) == 0x40) notes_.add("DAC: noise is not modelled");
      }
    } else if (offset == 0x04) {
      for (uint32_t channel = 0; channel < 2; ++channel) {
        if ((value & mask) >> channel & 1 && trigger_source(control(channel)) == software_trigger) {
          convert(channel, clock_.now());
        }
      }
    } else if (offset < 0x20) {
      const uint32_t form = (offset - first_holding) % holding_registers;
      hold((offset - first_holding) / holding_registers, form == right_12  ? value & 0xfff
                                                         : form == left_12 ? value >> 4 & 0xfff
                                                                           : (value & 0xff) << 4);
    } else if (offset == 0x20) {
      hold(0, value & 0xfff);
      hold(1, value >> 16 & 0xfff);
    }
  }
  void reset() override {
    cr_ = 0;
    for (uint32_t channel = 0; channel < channels_.size(); ++channel) {
      output(channel, 0, clock_.now());
      channels_[channel] = {};
    }
  }

  /// Called with the channel (0, 1) when a conversion wants its next code from DMA.
  void on_dma_request(std::function<void(uint32_t)> request) { dma_request_ = std::move(request); }

  /// The output as a share of full scale, at a moment since the change before last.
  [[nodiscard]] double share_at(uint32_t channel, Cycles at) const {
    const Channel& held = channels_[channel];
    const bool new_code = at >= held.changed;
    const uint32_t code = new_code ? held.output : held.before;
    if (!new_code) return code / 4095.0;
    const double settling_ns = 3'000 / std::log(4096.0);
    const double passed_ns = static_cast<double>(clock_.ns(at) - clock_.ns(held.changed));
    const double gap = (static_cast<double>(held.before) - code) * std::exp(-passed_ns / settling_ns);
    return (code + gap) / 4095.0;
  }

  /// The trigger output of timer `number` fired.
  void timer_trigger(uint8_t number, Cycles at) {
    constexpr uint8_t timer_of_source[] = {6, 8, 7, 5, 2, 4, 0, 0};
    for (uint32_t channel = 0; channel < 2; ++channel) {
      if (timer_of_source[trigger_source(control(channel))] == number) convert(channel, at);
    }
  }

 private:
  static constexpr uint32_t enabled = 1, trigger_enabled = 1 << 2, dma_enabled = 1 << 12;
  static constexpr uint32_t software_trigger = 7;
  /// Each channel's holding register in three forms: 12 bits right, 12 bits left, 8 bits right.
  static constexpr uint32_t first_holding = 0x08, holding_registers = 0x0c, right_12 = 0, left_12 = 4;

  static uint32_t trigger_source(uint32_t control) { return control >> 3 & 7; }

  uint32_t* word(uint32_t offset) override {
    return offset == 0x00   ? &cr_
           : offset == 0x2c ? &channels_[0].output
           : offset == 0x30 ? &channels_[1].output
                            : nullptr;
  }
  struct Channel {
    uint32_t holding = 0, output = 0, before = 0;  ///< `before`: the output until `changed`
    Cycles changed = 0;
    uint32_t triangle = 0;
    bool falls = false;
  };

  [[nodiscard]] uint32_t control(uint32_t channel) const { return cr_ >> (16 * channel) & 0x3fff; }
  void hold(uint32_t channel, uint32_t code) {
    channels_[channel].holding = code;
    if ((control(channel) & trigger_enabled) == 0) output(channel, code, clock_.now());
  }
  void convert(uint32_t channel, Cycles at) {
    constexpr uint32_t on = enabled | trigger_enabled;
    if ((control(channel) & on) != on) return;
    Channel& held = channels_[channel];
    if ((control(channel) >> 6 & 2) == 0) {
      output(channel, held.holding, at);
      if ((control(channel) & dma_enabled) != 0 && dma_request_) dma_request_(channel);
      return;
    }
    const uint32_t amplitude = (2U << std::min(control(channel) >> 8 & 0xf, 11U)) - 1;
    output(channel, std::min(held.holding + held.triangle, 0xfffU), at);
    if (held.triangle >= amplitude) held.falls = true;
    if (held.triangle == 0) held.falls = false;
    if (held.falls) {
      --held.triangle;
    } else {
      ++held.triangle;
    }
  }
  void output(uint32_t channel, uint32_t code, Cycles at) {
    Channel& held = channels_[channel];
    if ((control(channel) & enabled) == 0) code = 0;
    if (held.output == code) return;
    held.before = held.output;
    held.changed = at;
    held.output = code;
    log_.log_dac(static_cast<uint8_t>(channel + 1), static_cast<uint16_t>(code), at);
  }

  const Clock& clock_;
  PinLog& log_;
  Notes& notes_;
  std::function<void(uint32_t)> dma_request_;
  uint32_t cr_ = 0;
  std::array<Channel, 2> channels_{};
};

}  // namespace diastole::board_model
