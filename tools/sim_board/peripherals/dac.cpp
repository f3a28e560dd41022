#include "tools/sim_board/peripherals/dac.hpp"

#include <algorithm>

namespace diastole::board_model {
namespace {

constexpr uint32_t enabled = 1, trigger_enabled = 1 << 2, dma_enabled = 1 << 12;
constexpr uint32_t software_trigger = 7;
/// Each channel's holding register in three forms: 12 bits right, 12 bits left, 8 bits right.
constexpr uint32_t first_holding = 0x08, holding_registers = 0x0c, right_12 = 0, left_12 = 4;

uint32_t trigger_source(uint32_t control) { return control >> 3 & 7; }

}  // namespace

Dac::Dac(const Clock& clock, PinLog& log, Notes& notes) : clock_(clock), log_(log), notes_(notes) { reset(); }

void Dac::reset() {
  cr_ = 0;
  for (uint32_t channel = 0; channel < channels_.size(); ++channel) {
    output(channel, 0, clock_.now());
    channels_[channel] = {};
  }
}

uint32_t* Dac::word(uint32_t offset) {
  return offset == 0x00   ? &cr_
         : offset == 0x2c ? &channels_[0].output
         : offset == 0x30 ? &channels_[1].output
                          : nullptr;
}

uint32_t Dac::read(uint32_t offset) {
  if (offset == 0x20) return channels_[0].holding | channels_[1].holding << 16;
  if (offset < first_holding || offset >= 0x20) return RegisterBlock::read(offset);
  const uint32_t holding = channels_[(offset - first_holding) / holding_registers].holding;
  const uint32_t form = (offset - first_holding) % holding_registers;
  return form == right_12 ? holding : form == left_12 ? holding << 4 : holding >> 4;
}

void Dac::write(uint32_t offset, uint32_t value, uint32_t mask) {
  if (offset == 0x00) {
    RegisterBlock::write(offset, value, mask);
    for (uint32_t channel = 0; channel < 2; ++channel) {
      if ((control(channel) & enabled) == 0) output(channel, 0, clock_.now());
      if ((control(channel) & 0xc0) == 0) channels_[channel].triangle = 0;
      if ((control(channel) & 0xc0) == 0x40)
        notes_.add("DAC: noise is not modelled", clock_.ns(clock_.now()));
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

void Dac::hold(uint32_t channel, uint32_t code) {
  channels_[channel].holding = code;
  if ((control(channel) & trigger_enabled) == 0) output(channel, code, clock_.now());
}

void Dac::timer_trigger(uint8_t number, Cycles at) {
  constexpr uint8_t timer_of_source[] = {6, 8, 7, 5, 2, 4, 0, 0};
  for (uint32_t channel = 0; channel < 2; ++channel) {
    if (timer_of_source[trigger_source(control(channel))] == number) convert(channel, at);
  }
}

void Dac::convert(uint32_t channel, Cycles at) {
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

void Dac::output(uint32_t channel, uint32_t code, Cycles at) {
  Channel& held = channels_[channel];
  if ((control(channel) & enabled) == 0) code = 0;
  if (held.output == code) return;
  held.output = code;
  log_.log_dac(static_cast<uint8_t>(channel + 1), static_cast<uint16_t>(code), at);
}

}  // namespace diastole::board_model
