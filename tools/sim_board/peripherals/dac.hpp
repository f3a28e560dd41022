#pragma once
// DAC: two 12-bit channels, holding registers, triggers by timer, EXTI line 9 or software, and the triangle
// generator (RM0090, 14). Each change of an output code is logged.

#include <array>
#include <cstdint>
#include <functional>

#include "tools/sim_board/core/device.hpp"
#include "tools/sim_board/core/notes.hpp"
#include "tools/sim_board/core/pins.hpp"

namespace diastole::board_model {

class Dac final : public RegisterBlock {
 public:
  Dac(const Clock& clock, PinLog& log, Notes& notes);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;

  /// Called with the channel (0, 1) when a conversion wants its next code from DMA.
  void on_dma_request(std::function<void(uint32_t)> request) { dma_request_ = std::move(request); }

  /// The trigger output of timer `number` fired.
  void timer_trigger(uint8_t number, Cycles at);

 private:
  uint32_t* word(uint32_t offset) override;
  struct Channel {
    uint32_t holding = 0, output = 0;
    uint32_t triangle = 0;
    bool falls = false;
  };

  [[nodiscard]] uint32_t control(uint32_t channel) const { return cr_ >> (16 * channel) & 0x3fff; }
  void hold(uint32_t channel, uint32_t code);
  void convert(uint32_t channel, Cycles at);
  void output(uint32_t channel, uint32_t code, Cycles at);

  const Clock& clock_;
  PinLog& log_;
  Notes& notes_;
  std::function<void(uint32_t)> dma_request_;
  uint32_t cr_ = 0;
  std::array<Channel, 2> channels_{};
};

}  // namespace diastole::board_model
