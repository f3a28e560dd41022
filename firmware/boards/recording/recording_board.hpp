#pragma once
// A board of virtual time for the host: its pins are a log, its timer is a number, its serial line two
// queues. The rig's switches are simulated from the steps made: the home switch closes where mechanical steps
// <= 0 (and opens beyond its hysteresis), the far limit switch from Mechanics::far_limit_steps on.
//
// Most users want RecordedController (recorded_controller.hpp), which runs the firmware on it.

#include <algorithm>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <queue>
#include <span>
#include <utility>
#include <vector>

#include "firmware/boards/recording/memory_flash.hpp"
#include "firmware/core/board.hpp"
#include "firmware/core/r_wave.hpp"
#include "firmware/core/units.hpp"

namespace diastole::firmware {

enum class Signal : std::uint8_t { STEP, DIR, ENABLE, TTL, RWAVE_uV, FAULT };

/// One change of one pin; a pin trace file (contract: `time_ns,signal,value`) is a list of these.
struct Edge {
  Ticks tick;
  Signal signal{};
  std::int32_t value = 0;
  bool operator==(const Edge&) const = default;
};

/// A time as pin traces give it, rounded down.
constexpr std::int64_t nanoseconds(Ticks ticks) {
  return ticks.count / kTicksPerMicrosecond * 1000 +
         ticks.count % kTicksPerMicrosecond * 1000 / kTicksPerMicrosecond;
}

struct Mechanics {
  std::int32_t start_steps = 400;  ///< where the piston stands at reset, counted from the home switch
  std::int32_t far_limit_steps = 2'000'000'000;
  std::int32_t home_hysteresis_steps = 0;  ///< the home switch opens that much further out than it closes
  std::int32_t play_steps = 0;             ///< what the motor must turn back before the load comes along
  bool home_stuck = false;                 ///< closed for ever once it has closed
};

class RecordingBoard {
 public:
  using SettingsFlash = MemoryFlash;
  /// What outlives a reset: hand it to the next board.
  struct Memory {
    MemoryFlash flash;
    BlackBox::Memory retained{};
    std::optional<CrashRecord> crash;  ///< of the start before
  };
  struct Options {
    Identity identity{1, 0x0000B007, wire::ResetCause::power_on};
    Mechanics mechanics;
    RunningImage image;
    std::uint32_t baud = 460'800;
    std::size_t serial_buffer_bytes = 2048;
    std::uint32_t triggers_until_broken = 0;  ///< from that one on the TTL does not rise; 0: it always does
    bool clock_sound = true;
    bool supply_sound = true;
    std::shared_ptr<Memory> memory = std::make_shared<Memory>();
  };
  struct InterruptLock {
    explicit InterruptLock(RecordingBoard&) {}
  };

  explicit RecordingBoard(Options options)
      : options_(options),
        mechanical_steps_(options.mechanics.start_steps),
        load_steps_(options.mechanics.start_steps) {
    move_load();
  }

  // What the core sees (concept Board).
  [[nodiscard]] Ticks now() const { return now_; }
  [[nodiscard]] std::int32_t ticks_until(std::uint32_t tick) const {
    return ticks_between(lower_half(now_), tick);
  }
  void schedule(const PulseOrder& order) {
    order_ = order;
    order_due_ = whole_time(order.tick, now_);
    const bool inflating = pins_[static_cast<std::size_t>(Signal::DIR)] != 0;
    direction_due_.reset();
    if (order.step && order.inflate != inflating)
      direction_due_ = std::max(now_, order_due_ - kDirectionSetup);
  }
  void schedule_trigger(std::uint32_t tick, Ticks width, bool r_wave) {
    trigger_ = Trigger{whole_time(tick, now_), width, r_wave};
  }
  [[nodiscard]] std::optional<std::uint32_t> ttl_rise(std::uint32_t tick) const {
    if (!ttl_rose_ || ticks_between(tick, *ttl_rose_) < 0) return {};
    return ttl_rose_;
  }
  void use_signals(const SignalSettings& signals) {
    signals_ = signals;
    r_wave_codes_ = r_wave_codes(signals.r_wave_uV);
    set_ttl(false);
  }
  void rest() {}
  void cancel_pulses() {
    order_.reset();
    trigger_.reset();
    direction_due_.reset();
    set_ttl(false);
  }
  void set_motor_enabled(bool enabled) { set_pin(Signal::ENABLE, enabled); }
  void show_fault(std::uint8_t number) { set_pin(Signal::FAULT, number); }
  [[nodiscard]] Inputs inputs() const {
    return {estop_, forced_home_ || home_closed_,
            forced_far_limit_ || load_steps_ >= options_.mechanics.far_limit_steps};
  }
  [[nodiscard]] Identity identity() const { return options_.identity; }
  std::optional<std::uint8_t> serial_read() {
    if (from_host_.empty()) return {};
    const std::uint8_t byte = from_host_.front();
    from_host_.pop_front();
    return byte;
  }
  [[nodiscard]] std::size_t serial_room() const {
    const auto waiting = static_cast<std::size_t>(std::count_if(
        to_host_.begin(), to_host_.end(), [this](const SentByte& sent) { return sent.tick > now_; }));
    return options_.serial_buffer_bytes - std::min(waiting, options_.serial_buffer_bytes);
  }
  void serial_write(std::span<const std::uint8_t> bytes) {
    Ticks free = to_host_.empty() ? now_ : std::max(now_, to_host_.back().tick);
    for (const std::uint8_t byte : bytes)
      to_host_.push_back({free += byte_time(), byte});
  }
  void feed_watchdog() {}
  [[nodiscard]] bool clock_sound() const { return options_.clock_sound; }
  [[nodiscard]] bool supply_sound() const { return options_.supply_sound; }
  std::optional<CrashRecord> take_crash() { return std::exchange(options_.memory->crash, {}); }
  BlackBox::Memory& retained() { return options_.memory->retained; }
  MemoryFlash& settings_flash() { return options_.memory->flash; }
  [[nodiscard]] RunningImage running_image() const { return options_.image; }
  [[nodiscard]] bool takes_unsigned_firmware() const { return false; }  // it takes none
  bool confirm_image() {
    options_.image.state = wire::ImageState::confirmed;
    return true;
  }
  /// No wire leads back to this board.
  [[nodiscard]] wire::SelfTestReport self_test(const wire::SelfTest& request) const {
    wire::SelfTestReport report;
    report.item = request.item;
    report.argument = request.argument;
    report.ttl_late_ticks = report.step_late_ticks = report.r_wave_late_ticks = wire::kNotSeen;
    return report;
  }
  void restart(bool into_bootloader) {
    restart_ = into_bootloader ? Restart::into_bootloader : Restart::plain;
  }

  // What the world sees.
  /// The firmware has asked for a reset; what then runs is not modelled here.
  enum class Restart : std::uint8_t { none, plain, into_bootloader };
  [[nodiscard]] Restart restart_asked() const { return restart_; }
  /// The next moment at which a pin changes or an order is carried out.
  [[nodiscard]] std::optional<Ticks> next_event() const {
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
  /// Moves the clock to `tick`, at most the next event, and makes the edges due then; true if an order was
  /// carried out (compare interrupt). `inputs_changed` becomes true if a switch moved (input interrupt).
  bool run_to(Ticks tick, bool& inputs_changed) {
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
  void set_estop(bool pressed) { estop_ = pressed; }
  void set_far_limit(bool closed) { forced_far_limit_ = closed; }
  void set_home(bool closed) { forced_home_ = closed; }
  void receive(std::span<const std::uint8_t> bytes) {
    from_host_.insert(from_host_.end(), bytes.begin(), bytes.end());
  }
  /// Bytes whose last bit has left by now.
  std::vector<std::uint8_t> take_sent() {
    std::vector<std::uint8_t> bytes;
    while (!to_host_.empty() && to_host_.front().tick <= now_) {
      bytes.push_back(to_host_.front().byte);
      to_host_.pop_front();
    }
    return bytes;
  }
  std::vector<Edge> take_edges() { return std::exchange(edges_, {}); }
  void record_edges(bool on) { recording_ = on; }
  /// Where the load is that the motor drives with play, in the same count; it is what closes the switches.
  [[nodiscard]] std::int32_t load_steps() const { return load_steps_; }
  /// Steps made since reset, from the home switch; a step counts only while the motor is enabled.
  [[nodiscard]] std::int32_t mechanical_steps() const { return mechanical_steps_; }

 private:
  struct Later {
    bool operator()(const Edge& a, const Edge& b) const { return a.tick > b.tick; }
  };
  struct SentByte {
    Ticks tick;
    std::uint8_t byte;
  };
  [[nodiscard]] Ticks byte_time() const { return {kTicksPerSecond * 10 / options_.baud}; }
  void set_pin(Signal signal, std::int32_t value) {
    std::int32_t& pin = pins_[static_cast<std::size_t>(signal)];
    if (pin == value) return;
    pin = value;
    if (recording_) edges_.push_back({now_, signal, value});
  }
  void set_ttl(bool active) { set_pin(Signal::TTL, active != signals_.ttl_active_low ? 1 : 0); }
  void carry_out(const PulseOrder& order) {
    if (order.step) {
      set_pin(Signal::STEP, 1);
      coming_.push({now_ + kStepPulse, Signal::STEP, 0});
      const bool inflating = pins_[static_cast<std::size_t>(Signal::DIR)] != 0;
      if (pins_[static_cast<std::size_t>(Signal::ENABLE)] != 0) mechanical_steps_ += inflating ? 1 : -1;
      move_load();
    }
    if (order.ttl) raise_trigger(order.ttl_width, order.r_wave);
  }
  void raise_trigger(Ticks width, bool r_wave) {
    ttl_rose_.reset();
    if (options_.triggers_until_broken > 0 && --options_.triggers_until_broken == 0) ttl_broken_ = true;
    if (ttl_broken_) return;
    ttl_rose_ = lower_half(now_);
    set_ttl(true);
    coming_.push({now_ + width, Signal::TTL, signals_.ttl_active_low ? 1 : 0});
    if (!r_wave) return;
    for (std::size_t i = 0; i < kRWaveSamples; ++i)
      coming_.push({now_ + r_wave_sample_period(signals_.r_wave_us) * static_cast<std::int64_t>(i),
                    Signal::RWAVE_uV, static_cast<std::int32_t>(r_wave_uV(r_wave_codes_[i]))});
  }
  /// Inflating the motor pushes it along; withdrawing, it comes along once the play is taken up.
  void move_load() {
    load_steps_ =
        std::clamp(load_steps_, mechanical_steps_, mechanical_steps_ + options_.mechanics.play_steps);
    if (load_steps_ <= 0) home_closed_ = true;
    if (load_steps_ > options_.mechanics.home_hysteresis_steps && !options_.mechanics.home_stuck)
      home_closed_ = false;
  }

  Options options_;
  Ticks now_;
  std::optional<PulseOrder> order_;
  Ticks order_due_;
  std::optional<Ticks> direction_due_;
  std::optional<std::uint32_t> ttl_rose_;
  bool ttl_broken_ = false;
  SignalSettings signals_;
  RWaveCodes r_wave_codes_ = r_wave_codes(SignalSettings().r_wave_uV);
  struct Trigger {
    Ticks due;
    Ticks width;
    bool r_wave;
  };
  std::optional<Trigger> trigger_;                              ///< without an order
  std::priority_queue<Edge, std::vector<Edge>, Later> coming_;  ///< falling edges and R-wave samples
  std::int32_t pins_[6] = {};
  std::int32_t mechanical_steps_;
  std::int32_t load_steps_;
  bool home_closed_ = false;
  bool estop_ = false;
  bool forced_far_limit_ = false;
  bool forced_home_ = false;
  std::deque<std::uint8_t> from_host_;
  std::deque<SentByte> to_host_;
  std::vector<Edge> edges_;
  bool recording_ = true;
  Restart restart_ = Restart::none;
};

}  // namespace diastole::firmware
