#include "firmware/boards/recording/recording_board.hpp"

#include <algorithm>

#include "firmware/core/r_wave.hpp"

namespace diastole::firmware {

std::string_view signal_name(Signal signal) {
  static constexpr std::string_view kNames[] = {"STEP", "DIR", "ENABLE", "TTL", "RWAVE_uV", "FAULT"};
  return kNames[static_cast<std::size_t>(signal)];
}

void RecordingBoard::set_pin(Signal signal, std::int32_t value) {
  std::int32_t& pin = pins_[static_cast<std::size_t>(signal)];
  if (pin == value) return;
  pin = value;
  if (recording_) edges_.push_back({now_, signal, value});
}

void RecordingBoard::schedule(const PulseOrder& order) {
  order_ = order;
  order_due_ = whole_time(order.tick, now_);
  const bool inflating = pins_[static_cast<std::size_t>(Signal::DIR)] != 0;
  direction_due_.reset();
  if (order.step && order.inflate != inflating) direction_due_ = std::max(now_, order_due_ - kDirectionSetup);
}

void RecordingBoard::schedule_trigger(std::uint32_t tick, Ticks width, bool r_wave) {
  trigger_ = Trigger{whole_time(tick, now_), width, r_wave};
}

void RecordingBoard::cancel_pulses() {
  order_.reset();
  trigger_.reset();
  direction_due_.reset();
  set_pin(Signal::TTL, 0);
}

Inputs RecordingBoard::inputs() const {
  return {estop_, forced_home_ || home_closed_,
          forced_far_limit_ || load_steps_ >= options_.mechanics.far_limit_steps};
}

std::optional<std::uint8_t> RecordingBoard::serial_read() {
  if (from_host_.empty()) return {};
  const std::uint8_t byte = from_host_.front();
  from_host_.pop_front();
  return byte;
}

std::size_t RecordingBoard::serial_room() const {
  const auto waiting = static_cast<std::size_t>(std::count_if(
      to_host_.begin(), to_host_.end(), [this](const SentByte& sent) { return sent.tick > now_; }));
  return options_.serial_buffer_bytes - std::min(waiting, options_.serial_buffer_bytes);
}

void RecordingBoard::serial_write(std::span<const std::uint8_t> bytes) {
  Ticks free = to_host_.empty() ? now_ : std::max(now_, to_host_.back().tick);
  for (const std::uint8_t byte : bytes)
    to_host_.push_back({free += byte_time(), byte});
}

std::vector<std::uint8_t> RecordingBoard::take_sent() {
  std::vector<std::uint8_t> bytes;
  while (!to_host_.empty() && to_host_.front().tick <= now_) {
    bytes.push_back(to_host_.front().byte);
    to_host_.pop_front();
  }
  return bytes;
}

std::optional<Ticks> RecordingBoard::next_event() const {
  std::optional<Ticks> next;
  const auto consider = [&next](Ticks tick) {
    if (!next || tick < *next) next = tick;
  };
  if (order_) consider(order_due_);
  if (direction_due_) consider(*direction_due_);
  if (trigger_) consider(trigger_->due);
  if (!coming_.empty()) consider(coming_.top().tick);
  return next;
}

void RecordingBoard::carry_out(const PulseOrder& order) {
  if (order.step) {
    set_pin(Signal::STEP, 1);
    coming_.push({now_ + kStepPulse, Signal::STEP, 0});
    const bool inflating = pins_[static_cast<std::size_t>(Signal::DIR)] != 0;
    if (pins_[static_cast<std::size_t>(Signal::ENABLE)] != 0) mechanical_steps_ += inflating ? 1 : -1;
    move_load();
  }
  if (order.ttl) raise_trigger(order.ttl_width, order.r_wave);
}

void RecordingBoard::raise_trigger(Ticks width, bool r_wave) {
  set_pin(Signal::TTL, 1);
  coming_.push({now_ + width, Signal::TTL, 0});
  if (!r_wave) return;
  for (std::size_t i = 0; i < kRWaveSamples; ++i)
    coming_.push({now_ + kRWaveSamplePeriod * static_cast<std::int64_t>(i), Signal::RWAVE_uV,
                  static_cast<std::int32_t>(r_wave_uV(kRWaveCodes[i]))});
}

/// Inflating the motor pushes it along; withdrawing, it comes along once the play is taken up.
void RecordingBoard::move_load() {
  load_steps_ = std::clamp(load_steps_, mechanical_steps_, mechanical_steps_ + options_.mechanics.play_steps);
  if (load_steps_ <= 0) home_closed_ = true;
  if (load_steps_ > options_.mechanics.home_hysteresis_steps && !options_.mechanics.home_stuck)
    home_closed_ = false;
}

bool RecordingBoard::run_to(Ticks tick, bool& inputs_changed) {
  now_ = tick;
  if (direction_due_ && *direction_due_ <= now_) {
    direction_due_.reset();
    set_pin(Signal::DIR, order_->inflate);
  }
  const bool matched = order_ && order_due_ <= now_;
  if (matched) {
    const Inputs before = inputs();
    carry_out(*std::exchange(order_, {}));
    const Inputs after = inputs();
    inputs_changed = before.home != after.home || before.far_limit != after.far_limit;
  }
  if (trigger_ && trigger_->due <= now_) {
    raise_trigger(trigger_->width, trigger_->r_wave);
    trigger_.reset();
  }
  while (!coming_.empty() && coming_.top().tick <= now_) {
    set_pin(coming_.top().signal, coming_.top().value);
    coming_.pop();
  }
  return matched;
}

}  // namespace diastole::firmware
