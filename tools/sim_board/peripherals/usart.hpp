#pragma once
// USART: status and data registers, byte times from BRR, receive, transmit-empty and transmission-complete
// interrupts, overrun (RM0090, 30). The other end of the line is a queue of bytes that arrive back to back.

#include <cstdint>
#include <deque>
#include <functional>

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

  Usart(Shape shape, const Clock& clock, Scheduler& scheduler, Nvic& nvic);

  uint32_t read(uint32_t offset) override;
  void write(uint32_t offset, uint32_t value, uint32_t mask) override;
  void reset() override;
  void on_event(Cycles at) override;
  void after_clock_change() override;

  /// A byte starts on the line towards the board as soon as the line is free.
  void receive(uint8_t byte);
  /// Called at the end of each byte's stop bit.
  void on_sent(std::function<void(uint8_t, Cycles)> sink) { sent_ = std::move(sink); }

  /// Enabled as transmitter or receiver: this is a port that the firmware talks through.
  [[nodiscard]] bool in_use() const { return (cr1_ & 0x2000) != 0 && (cr1_ & 0xc) != 0; }
  [[nodiscard]] uint64_t overruns() const { return overruns_; }
  [[nodiscard]] std::size_t waiting_bytes() const { return incoming_.size(); }

 private:
  uint32_t* word(uint32_t offset) override;
  [[nodiscard]] Cycles byte_cycles() const;
  void start_sending(uint8_t byte, Cycles at);
  void start_receiving(Cycles at);
  void set_line();
  void ask();

  Shape shape_;
  const Clock& clock_;
  Scheduler& scheduler_;
  Nvic& nvic_;
  Scheduler::Slot slot_;
  std::function<void(uint8_t, Cycles)> sent_;
  std::deque<uint8_t> incoming_;

  uint32_t sr_ = 0xc0, brr_ = 0, cr1_ = 0, cr2_ = 0, cr3_ = 0, gtpr_ = 0;
  uint8_t received_ = 0, shifting_ = 0, next_ = 0;
  bool next_waits_ = false, overrun_pending_clear_ = false;
  Cycles sent_at_ = never, received_at_ = never;
  uint64_t overruns_ = 0;
};

}  // namespace diastole::board_model
