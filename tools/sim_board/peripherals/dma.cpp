#include "tools/sim_board/peripherals/dma.hpp"

#include <algorithm>
#include <string>

namespace diastole::board_model {
namespace {

constexpr uint32_t enabled = 1, error_interrupt = 1 << 2, half_interrupt = 1 << 3,
                   complete_interrupt = 1 << 4, circular = 1 << 8, peripheral_increments = 1 << 9,
                   memory_increments = 1 << 10;
constexpr uint32_t error_flag = 1 << 3, half_flag = 1 << 4, complete_flag = 1 << 5;

constexpr uint32_t first_stream_register = 0x10, stream_registers = 0x18;
/// Place of a stream's six flags in LISR/HISR and LIFCR/HIFCR.
constexpr uint32_t flag_shift[] = {0, 6, 16, 22};

constexpr uint32_t irq_of[2][Dma::stream_count] = {{11, 12, 13, 14, 15, 16, 17, 47},
                                                   {56, 57, 58, 59, 60, 68, 69, 70}};

}  // namespace

Dma::Dma(uint8_t number, Bus& bus, Memory& memory, Nvic& nvic, const Clock& clock, Notes& notes)
    : number_(number), bus_(bus), memory_(memory), nvic_(nvic), clock_(clock), notes_(notes) {}

void Dma::reset() {
  streams_.fill({});
  for (uint32_t stream = 0; stream < stream_count; ++stream)
    set_line(stream);
}

uint32_t* Dma::word(uint32_t offset) {
  const uint32_t index = (offset - first_stream_register) / stream_registers;
  if (offset < first_stream_register || index >= stream_count) return nullptr;
  Stream& stream = streams_[index];
  return in_order(
      (offset - first_stream_register) % stream_registers,
      {&stream.control, &stream.left, &stream.peripheral, &stream.memory0, &stream.memory1, &stream.fifo});
}

uint32_t Dma::read(uint32_t offset) {
  if (offset >= 8) return RegisterBlock::read(offset);
  uint32_t flags = 0;
  for (uint32_t i = 0; i < 4; ++i)
    flags |= streams_[offset + i].flags << flag_shift[i];
  return flags;
}

void Dma::write(uint32_t offset, uint32_t value, uint32_t mask) {
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
  stream.left &= 0xffff;
  if (!was_on && (stream.control & enabled) != 0) start(stream);
  set_line(index);
}

void Dma::start(Stream& stream) {
  stream.programmed = stream.left;
  stream.at = stream.memory0;
  if ((stream.control >> 6 & 3) == 2 || (stream.control & 1U << 18) != 0) {
    notes_.add("DMA: memory to memory and double buffers are not modelled", clock_.ns(clock_.now()));
  }
}

void Dma::request(uint32_t index, uint32_t channel) {
  Stream& stream = streams_[index];
  if ((stream.control & enabled) == 0 || stream.control >> 25 != channel || stream.left == 0) return;
  transfer(stream);
  set_line(index);
}

void Dma::transfer(Stream& stream) {
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

void Dma::set_line(uint32_t index) {
  const Stream& stream = streams_[index];
  const bool asks = ((stream.flags & complete_flag) != 0 && (stream.control & complete_interrupt) != 0) ||
                    ((stream.flags & half_flag) != 0 && (stream.control & half_interrupt) != 0) ||
                    ((stream.flags & error_flag) != 0 && (stream.control & error_interrupt) != 0);
  nvic_.set_line(irq_of[number_ - 1][index], asks);
}

}  // namespace diastole::board_model
