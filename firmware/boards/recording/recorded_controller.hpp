#pragma once
// The firmware on the recording board: bytes in, bytes out, time given from outside.
//
//   RecordedController controller;
//   controller.feed(bytes_from_host);                  // taken from the line now
//   controller.advance_to(seconds(0.1));               // runs main loop, timers and interrupts in time order
//   for (byte : controller.take_output()) ...          // what has left the line by now, at the board's baud
//   for (edge : controller.take_edges()) ...           // every pin change since the last call, in time order
//
// Deterministic: equal calls give equal bytes and equal edges.

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "firmware/boards/recording/recording_board.hpp"
#include "firmware/core/controller.hpp"

namespace diastole::firmware {

class RecordedController {
 public:
  struct Options {
    RecordingBoard::Options board;
    Ticks turn = microseconds(250);  ///< one turn of the main loop
  };

  RecordedController() : RecordedController(Options{}) {}
  explicit RecordedController(Options options)
      : turn_(options.turn), board_(options.board), controller_(board_) {}
  RecordedController(const RecordedController&) = delete;
  RecordedController& operator=(const RecordedController&) = delete;

  [[nodiscard]] Ticks now() const { return board_.now(); }
  /// Runs until `tick`; earlier ticks do nothing.
  void advance_to(Ticks tick) {
    while (true) {
      const std::optional<Ticks> event = board_.next_event();
      const Ticks next = event ? std::min(*event, next_turn_) : next_turn_;
      if (next > tick) break;
      bool inputs_changed = false;
      const bool matched = board_.run_to(next, inputs_changed);
      if (inputs_changed) controller_.on_inputs();
      if (matched) controller_.on_match();
      if (next_turn_ <= next) {
        controller_.poll();
        next_turn_ = next + turn_;
      }
    }
    bool inputs_changed = false;
    if (tick > board_.now()) board_.run_to(tick, inputs_changed);
  }

  void feed(std::span<const std::uint8_t> bytes) { board_.receive(bytes); }
  std::vector<std::uint8_t> take_output() { return board_.take_sent(); }

  std::vector<Edge> take_edges() { return board_.take_edges(); }
  /// Off: take_edges() stays empty and long simulations need no memory.
  void record_edges(bool on) { board_.record_edges(on); }

  /// Microsteps from the position that homing called 0 (before homing: from where the motor was at reset).
  [[nodiscard]] std::int32_t position_microsteps() const {
    return controller_.motion().engine().counters().position.count;
  }
  /// Microsteps from the home switch: never jumps, whatever the firmware believes.
  [[nodiscard]] std::int32_t mechanical_microsteps() const { return board_.mechanical_steps(); }

  /// The load driven with Mechanics::play_steps.
  [[nodiscard]] std::int32_t load_microsteps() const { return board_.load_steps(); }

  /// Whether the firmware has asked for a reset; it is not carried out.
  [[nodiscard]] RecordingBoard::Restart restart_asked() const { return board_.restart_asked(); }

  void set_estop(bool pressed) {
    board_.set_estop(pressed);
    controller_.on_inputs();
  }
  void set_far_limit(bool closed) {
    board_.set_far_limit(closed);
    controller_.on_inputs();
  }
  void set_home(bool closed) {
    board_.set_home(closed);
    controller_.on_inputs();
  }
  /// The main loop does not come round until then (interrupts do).
  void stall_until(Ticks tick) { next_turn_ = tick; }

  [[nodiscard]] const Controller<RecordingBoard>& controller() const { return controller_; }

 private:
  Ticks turn_;
  RecordingBoard board_;
  Controller<RecordingBoard> controller_;
  Ticks next_turn_;
};

}  // namespace diastole::firmware
