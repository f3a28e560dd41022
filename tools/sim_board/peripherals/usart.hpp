#pragma once
// USART: status and data registers, byte times from BRR, receive, transmit-empty and transmission-complete
// interrupts, overrun (RM0090, 30). The other end of the line is a queue of bytes that arrive back to back.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "tools/sim_board/core/nvic.hpp"
#include "tools/sim_board/core/scheduler.hpp"

namespace diastole::board_model {

class Usart final : public RegisterBlock {
 public:
  struct Shape {
    uint8_t number = 1;
    bool on_apb2 = true;
    uint32_t irq = 37;
  };

  Usart(Shape shape, const Clock& clock, Scheduler& scheduler, Nvic& nvic)
      : shape_(shape), clock_(clock), scheduler_(scheduler), nvic_(nvic), slot_(scheduler.add(*this)) {
    reset();
  }

  std::optional<uint32_t> read(uint32_t offset) override {
    if (offset == 0x00) overrun_pending_clear_ = (sr_ & overrun) != 0;
    if (offset != 0x04) return RegisterBlock::read(offset);
    sr_ &= ~(receive_full | noise | framing_error);
    if (overrun_pending_clear_) sr_ &= ~overrun;
    overrun_pending_clear_ = false;
    set_line();
    return received_;
  }
  void write(uint32_t offset, uint32_t value, uint32_t mask) override {
    if (offset == 0x00) {
      sr_ &= value | ~(mask & (receive_full | complete));  // rc_w0
    } else if (offset == 0x04) {
      start_sending(static_cast<uint8_t>(value), clock_.now());
    } else {
      RegisterBlock::write(offset, value, mask);
      if (offset == 0x0c) start_receiving(clock_.now());
    }
    set_line();
    ask();
  }
  void reset() override {
    sr_ = transmit_empty | complete;
    brr_ = cr1_ = cr2_ = cr3_ = gtpr_ = 0;
    next_waits_ = overrun_pending_clear_ = false;
    sent_at_ = received_at_ = never;
    incoming_.clear();
    set_line();
    ask();
  }
  void on_event(Cycles at) override {
    if (sent_at_ <= at) {
      const uint8_t done = shifting_;
      sent_at_ = never;
      if (next_waits_) {
        shifting_ = next_;
        next_waits_ = false;
        sent_at_ = at + byte_cycles();
        sr_ |= transmit_empty;
      } else {
        sr_ |= complete;
      }
      if (sent_) sent_(done, at);
    }
    if (received_at_ <= at) {
      received_at_ = never;
      if ((sr_ & receive_full) != 0) {
        sr_ |= overrun;
        ++overruns_;
      } else {
        received_ = incoming_.front().value;
        sr_ |= receive_full | (incoming_.front().framed ? 0 : noise | framing_error);
      }
      incoming_.pop_front();
      start_receiving(at);
    }
    set_line();
    ask();
  }
  void after_clock_change() override { ask(); }

  /// A byte starts on the line towards the board as soon as the line is free; not `framed`: what stands where its stop bit
  /// should be is low.
  void receive(uint8_t byte, bool framed = true) {
    incoming_.push_back({byte, framed});
    start_receiving(clock_.now());
    ask();
  }
  /// Called at the end of each byte's stop bit.
  void on_sent(std::function<void(uint8_t, Cycles)> sink) { sent_ = std::move(sink); }

  /// Enabled as transmitter or receiver: this is a port that the firmware talks through.
  [[nodiscard]] bool in_use() const { return (cr1_ & 0x2000) != 0 && (cr1_ & 0xc) != 0; }
  [[nodiscard]] uint64_t overruns() const { return overruns_; }
  [[nodiscard]] std::size_t waiting_bytes() const { return incoming_.size(); }

 private:
  struct LineByte {
    uint8_t value = 0;
    bool framed = true;
  };
  static constexpr uint32_t framing_error = 1 << 1, noise = 1 << 2, overrun = 1 << 3, receive_full = 1 << 5,
                            complete = 1 << 6, transmit_empty = 1 << 7;
  static constexpr uint32_t enable = 1 << 13, transmitter = 1 << 3, receiver = 1 << 2, oversample_8 = 1 << 15,
                            nine_bits = 1 << 12;

  uint32_t* word(uint32_t offset) override {
    return in_order(offset, {&sr_, nullptr, &brr_, &cr1_, &cr2_, &cr3_, &gtpr_});
  }
  [[nodiscard]] Cycles byte_cycles() const {
    const Cycles ratio = shape_.on_apb2 ? clock_.tree().apb2_ratio : clock_.tree().apb1_ratio;
    const Cycles bit = (cr1_ & oversample_8) != 0 ? 8 * (brr_ >> 4) + (brr_ & 7) : brr_;
    const Cycles bits = ((cr1_ & nine_bits) != 0 ? 11 : 10) + ((cr2_ >> 12 & 3) == 2 ? 1 : 0);
    return std::max<Cycles>(bit, 1) * bits * ratio;
  }
  void start_sending(uint8_t byte, Cycles at) {
    if ((cr1_ & (enable | transmitter)) != (enable | transmitter)) return;
    sr_ &= ~complete;
    if (sent_at_ == never) {
      shifting_ = byte;
      sent_at_ = at + byte_cycles();
      return;
    }
    next_ = byte;
    next_waits_ = true;
    sr_ &= ~transmit_empty;
  }
  void start_receiving(Cycles at) {
    const bool listens = (cr1_ & (enable | receiver)) == (enable | receiver);
    if (!listens) {
      incoming_.clear();  // nobody hears it
      received_at_ = never;
    } else if (received_at_ == never && !incoming_.empty()) {
      received_at_ = at + byte_cycles();
    }
  }
  void set_line() {
    const bool asked = ((cr1_ & receive_full) != 0 && (sr_ & (receive_full | overrun)) != 0) ||
                       (cr1_ & sr_ & (transmit_empty | complete)) != 0;
    nvic_.set_line(shape_.irq, asked);
  }
  void ask() { scheduler_.set(slot_, std::min(sent_at_, received_at_)); }

  Shape shape_;
  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Scheduler::Slot slot_;
  std::function<void(uint8_t, Cycles)> sent_;
  std::deque<LineByte> incoming_;

  uint32_t sr_ = 0xc0, brr_ = 0, cr1_ = 0, cr2_ = 0, cr3_ = 0, gtpr_ = 0;
  uint8_t received_ = 0, shifting_ = 0, next_ = 0;
  bool next_waits_ = false, overrun_pending_clear_ = false;
  Cycles sent_at_ = never, received_at_ = never;
  uint64_t overruns_ = 0;
};

}  // namespace diastole::board_model
