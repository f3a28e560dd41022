#pragma once
// The whole controller over a board: link, dispatch, motion, telemetry. A board's main program is
//
//   BoardType board;  Controller<BoardType> controller(board);
//   for (;;) controller.poll();
//
// with the compare interrupt calling on_match() and the input interrupts calling on_inputs(). poll() must
// come round within Motion::kHorizon.

#include "firmware/core/dispatch.hpp"
#include "firmware/core/image_trial.hpp"
#include "firmware/core/motion.hpp"
#include "firmware/core/outbox.hpp"
#include "firmware/core/settings_store.hpp"
#include "firmware/core/telemetry.hpp"
#include "protocol/wire/reliable_link.hpp"

namespace diastole::firmware {

template <Board B>
class Controller {
 public:
  explicit Controller(B& board)
      : board_(board),
        settings_(board.settings_flash()),
        motion_(board, outbox_),
        trial_(board, motion_),
        dispatch_(board, motion_, settings_, trial_, outbox_, link_),
        telemetry_(motion_, outbox_) {
    motion_.use(settings_.settings(), settings_.records_written() > 0);
  }

  /// One turn of the main loop.
  void poll() {
    board_.feed_watchdog();
    receive();
    motion_.poll();
    trial_.poll();
    telemetry_.pump(link_);
    transmit();
  }

  void on_match() { motion_.on_match(); }
  void on_inputs() { motion_.on_inputs(); }

  [[nodiscard]] const Motion<B>& motion() const { return motion_; }
  [[nodiscard]] const wire::ReliableLink& link() const { return link_; }

 private:
  /// Bytes taken in one turn: a flooded line must not keep the queue from being refilled.
  static constexpr int kBytesPerTurn = 256;

  [[nodiscard]] std::uint64_t now_us() const { return on_wire(board_.now()) / kTicksPerMicrosecond; }

  void receive() {
    for (int i = 0; i < kBytesPerTurn; ++i) {
      const auto byte = board_.serial_read();
      if (!byte) return;
      if (const auto received = link_.receive(*byte, now_us())) dispatch_.receive(*received);
    }
  }

  void transmit() {
    while (board_.serial_room() >= wire::kMaxEncodedBytes) {
      const auto bytes = link_.transmit(now_us());
      if (bytes.empty()) return;
      board_.serial_write(bytes);
    }
  }

  B& board_;
  wire::ReliableLink link_{wire::ReliableLink::Role::controller};
  Outbox outbox_;
  SettingsStore<typename B::SettingsFlash> settings_;
  Motion<B> motion_;
  ImageTrial<B> trial_;
  Dispatch<B> dispatch_;
  Telemetry<B> telemetry_;
};

}  // namespace diastole::firmware
