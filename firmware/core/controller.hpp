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
        black_box_(board.retained()),
        motion_(board, outbox_, black_box_),
        trial_(board, motion_),
        dispatch_(board, motion_, settings_, black_box_, trial_, outbox_, link_),
        telemetry_(motion_, outbox_) {
    motion_.use(settings_.settings(), settings_.records_written() > 0);
  }

  /// One turn of the main loop.
  void poll() {
    board_.feed_watchdog();
    if (!begun_) begin();
    receive();
    note_link();
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

  /// A host that has said nothing for so long is noted as lost.
  static constexpr std::uint64_t kLinkSilence_us = 1'000'000;

  void begin() {
    begun_ = true;
    const Identity identity = board_.identity();
    black_box_.begin(identity.reset_cause, identity.boot_id, board_.now());
    if (const auto crash = board_.take_crash()) black_box_.note_crash(*crash, board_.now());
    if (!board_.clock_sound()) motion_.stay_faulted(wire::Fault::clock);
  }
  void note_link() {
    const bool open = link_.state() == wire::ReliableLink::State::open &&
                      now_us() - link_.last_heard_us() < kLinkSilence_us;
    if (open == link_open_ && link_.session() == session_) return;
    link_open_ = open;
    session_ = link_.session();
    black_box_.note(wire::Noted::link, open ? 1 : 0, session_, board_.now());
  }

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
  BlackBox black_box_;
  bool begun_ = false;
  bool link_open_ = false;
  std::uint16_t session_ = 0;
  Motion<B> motion_;
  ImageTrial<B> trial_;
  Dispatch<B> dispatch_;
  Telemetry<B> telemetry_;
};

}  // namespace diastole::firmware
