#pragma once
// DMA1 and DMA2: streams that move one item per request of a peripheral between memory and its data register,
// with half and complete flags, their interrupts, and circular mode (RM0090, 10). Transfers take no time.
// Memory to memory, double buffers, bursts and the FIFO are not modelled.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>

#include "tools/sim_board/core/bus.hpp"
#include "tools/sim_board/core/memory.hpp"
#include "tools/sim_board/core/nvic.hpp"

namespace diastole::board_model {

class Dma final : public RegisterBlock {
 public:
  static constexpr uint32_t stream_count = 8;

  Dma(uint8_t number, Bus& bus, Memory& memory, Nvic& nvic, Notes& notes)
      : number_(number), bus_(bus), memory_(memory), nvic_(nvic), notes_(notes) {}

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset >= 8) return RegisterBlock::read(offset);
    uint32_t flags = 0;
    for (uint32_t i = 0; i < 4; ++i)
      flags |= streams_[offset + i].flags << flag_shift[i];
    return flags;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (offset >= 8 && offset < first_stream_register) {
      for (uint32_t i = 0; i < 4; ++i) {
        const uint32_t stream = offset - 8 + i;
        streams_[stream].flags &= ~((value & mask) >> flag_shift[i] & 0x3d);
        set_line(stream);
      }
      return;
    }
    const uint32_t index = (offset - first_stream_register) / stream_registers;
    if (offset < first_stream_register || index >= stream_count) return;
    Stream& stream = streams_[index];
    const bool was_on = (stream.control & enabled) != 0;
    RegisterBlock::write(offset, value, mask);
    if (stream.stuck && was_on) stream.control |= enabled;
    stream.left &= 0xffff;
    if (!was_on && (stream.control & enabled) != 0) start(stream);
    set_line(index);
  }
  void reset() override {
    streams_.fill({});
    for (uint32_t stream = 0; stream < stream_count; ++stream)
      set_line(stream);
  }

  /// The stream carries nothing any more and keeps its enable bit: what a transfer that never ends looks like.
  void stick(uint32_t index) { streams_[index].stuck = true; }

  /// A peripheral wired to `channel` of `stream` asks for one item.
  void request(uint32_t index, uint32_t channel) {
    Stream& stream = streams_[index];
    if ((stream.control & enabled) == 0 || stream.control >> 25 != channel || stream.left == 0 ||
        stream.stuck)
      return;
    transfer(stream);
    set_line(index);
  }

 private:
  static constexpr uint32_t enabled = 1, error_interrupt = 1 << 2, half_interrupt = 1 << 3,
                            complete_interrupt = 1 << 4, circular = 1 << 8, peripheral_increments = 1 << 9,
                            memory_increments = 1 << 10;
  static constexpr uint32_t error_flag = 1 << 3, half_flag = 1 << 4, complete_flag = 1 << 5;

  static constexpr uint32_t first_stream_register = 0x10, stream_registers = 0x18;
  /// Place of a stream's six flags in LISR/HISR and LIFCR/HIFCR.
  static constexpr uint32_t flag_shift[] = {0, 6, 16, 22};

  static constexpr uint32_t irq_of[2][Dma::stream_count] = {{11, 12, 13, 14, 15, 16, 17, 47},
                                                            {56, 57, 58, 59, 60, 68, 69, 70}};

  uint32_t* word(uint32_t offset) override {
    const uint32_t index = (offset - first_stream_register) / stream_registers;
    if (offset < first_stream_register || index >= stream_count) return nullptr;
    Stream& stream = streams_[index];
    return in_order(
        (offset - first_stream_register) % stream_registers,
        {&stream.control, &stream.left, &stream.peripheral, &stream.memory0, &stream.memory1, &stream.fifo});
  }
  struct Stream {
    uint32_t control = 0, peripheral = 0, memory0 = 0, memory1 = 0, fifo = 0x21;
    uint32_t left = 0;  ///< NDTR
    uint32_t programmed = 0;
    uint32_t at = 0;  ///< next memory address
    bool stuck = false;
    uint32_t flags = 0;  ///< bit 0 FEIF, 2 DMEIF, 3 TEIF, 4 HTIF, 5 TCIF
  };

  void transfer(Stream& stream) {
    const uint32_t bytes = 1U << std::min(stream.control >> 11 & 3, 2U);
    const auto memory = memory_.at(stream.at, bytes);
    if (memory.empty()) {
      stream.flags |= error_flag;
      stream.control &= ~enabled;
      return;
    }
    if ((stream.control >> 6 & 3) == 1) {
      uint32_t value = 0;
      std::copy(memory.begin(), memory.end(), reinterpret_cast<uint8_t*>(&value));
      bus_.write(stream.peripheral, value, bytes);
    } else {
      const uint32_t value = bus_.read(stream.peripheral, bytes);
      std::copy_n(reinterpret_cast<const uint8_t*>(&value), bytes, memory.begin());
    }
    if (stream.control & memory_increments) stream.at += bytes;
    if (stream.control & peripheral_increments) stream.peripheral += bytes;
    if (--stream.left == stream.programmed / 2) stream.flags |= half_flag;
    if (stream.left != 0) return;
    stream.flags |= complete_flag;
    if (stream.control & circular) {
      stream.left = stream.programmed;
      stream.at = stream.memory0;
    } else {
      stream.control &= ~enabled;
    }
  }
  void set_line(uint32_t index) {
    const Stream& stream = streams_[index];
    const bool asks = ((stream.flags & complete_flag) != 0 && (stream.control & complete_interrupt) != 0) ||
                      ((stream.flags & half_flag) != 0 && (stream.control & half_interrupt) != 0) ||
                      ((stream.flags & error_flag) != 0 && (stream.control & error_interrupt) != 0);
    nvic_.set_line(irq_of[number_ - 1][index], asks);
  }
  void start(Stream& stream) {
    stream.programmed = stream.left;
    stream.at = stream.memory0;
    if ((stream.control >> 6 & 3) == 2 || (stream.control & 1U << 18) != 0) {
      notes_.add("DMA: memory to memory and double buffers are not modelled");
    }
  }

  uint8_t number_;
  Bus& bus_;
  Memory& memory_;
  Nvic& nvic_;
  Notes& notes_;
  std::array<Stream, stream_count> streams_{};
};

}  // namespace diastole::board_model
