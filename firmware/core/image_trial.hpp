#pragma once
// The application's part in its own replacement: who am I, into the bootloader, confirmed. An image on trial
// that nobody confirms resets itself, and the bootloader returns to the confirmed one.

#include <optional>

#include "firmware/core/motion.hpp"
#include "firmware/core/outbox.hpp"

namespace diastole::firmware {

template <Board B>
class ImageTrial {
 public:
  /// How long an image may run unconfirmed; longer if it is not at rest then.
  static constexpr Ticks kTrial = microseconds(20'000'000);
  /// From the order to enter the bootloader to the reset: time for the answer to leave.
  static constexpr Ticks kRestartDelay = microseconds(50'000);

  ImageTrial(B& board, Motion<B>& motion) : board_(board), motion_(motion) {}

  wire::UpdateOutcome enter_bootloader() {
    if (!at_rest_and_disarmed()) return wire::UpdateOutcome::not_at_rest;
    motion_.let_go();
    restart_at_ = board_.now() + kRestartDelay;
    return wire::UpdateOutcome::done;
  }

  wire::UpdateOutcome confirm(std::uint64_t build_id) {
    const RunningImage image = board_.running_image();
    if (image.build_id != build_id) return wire::UpdateOutcome::other_image;
    if (image.state == wire::ImageState::confirmed) return wire::UpdateOutcome::done;
    if (!at_rest_and_disarmed()) return wire::UpdateOutcome::not_at_rest;
    if (!board_.supply_sound()) return wire::UpdateOutcome::supply_low;
    if (!board_.confirm_image()) return wire::UpdateOutcome::flash_failed;
    trial_ends_.reset();
    return wire::UpdateOutcome::done;
  }

  /// One turn of the main loop. A reset that is due on trial waits until the motor is at rest; a motion asked for
  /// after the order to enter the bootloader takes that order back.
  void poll() {
    const Ticks now = board_.now();
    if (!begun_ && board_.running_image().state == wire::ImageState::on_trial) trial_ends_ = now + kTrial;
    begun_ = true;
    if (!at_rest_and_disarmed()) restart_at_.reset();
    const bool restart_due = restart_at_ && *restart_at_ <= now;
    const bool failed = trial_ends_ && *trial_ends_ <= now;
    if ((!restart_due && !failed) || !at_rest_and_disarmed()) return;
    motion_.let_go();
    board_.restart(restart_due);
  }

 private:
  [[nodiscard]] bool at_rest_and_disarmed() const {
    using enum wire::State;
    const wire::State state = motion_.safety().state();
    return state == unhomed || state == homed || state == faulted;
  }

  B& board_;
  Motion<B>& motion_;
  bool begun_ = false;
  std::optional<Ticks> trial_ends_;
  std::optional<Ticks> restart_at_;
};

}  // namespace diastole::firmware
