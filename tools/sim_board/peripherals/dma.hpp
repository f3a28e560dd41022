#pragma once
// DMA1 and DMA2: streams that move one item per request of a peripheral between memory and its data register,
// with half and complete flags, their interrupts, and circular mode (RM0090, 10). Transfers take no time.
// Memory to memory, double buffers, bursts and the FIFO are not modelled.

#include <array>
#include <cstdint>

#include "tools/sim_board/core/bus.hpp"
#include "tools/sim_board/core/memory.hpp"
#include "tools/sim_board/core/nvic.hpp"

namespace diastole::board_model {

class Dma final : public RegisterBlock {
 public:
  static constexpr uint32_t stream_count = 8;

  Dma(uint8_t number, Bus& bus, Memory& memory, Nvic& nvic, const Clock& clock, Notes& notes);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;

  /// A peripheral wired to `channel` of `stream` asks for one item.
  void request(uint32_t stream, uint32_t channel);

 private:
  uint32_t* word(uint32_t offset) override;
  struct Stream {
    uint32_t control = 0, peripheral = 0, memory0 = 0, memory1 = 0, fifo = 0x21;
    uint32_t left = 0;  ///< NDTR
    uint32_t programmed = 0;
    uint32_t at = 0;     ///< next memory address
    uint32_t flags = 0;  ///< bit 0 FEIF, 2 DMEIF, 3 TEIF, 4 HTIF, 5 TCIF
  };

  void transfer(Stream& stream);
  void set_line(uint32_t stream);
  void start(Stream& stream);

  uint8_t number_;
  Bus& bus_;
  Memory& memory_;
  Nvic& nvic_;
  const Clock& clock_;
  Notes& notes_;
  std::array<Stream, stream_count> streams_{};
};

}  // namespace diastole::board_model
