#pragma once
// The interrupt path: takes planned events from the queue, gives them to the timer one by one, and counts
// what the timer has done. push() and the telemetry belong to the main loop, on_match() to the compare
// interrupt.
//
//   Planner ──push()──▶ queue ──load()──▶ Board::schedule ──edge──▶ on_match(): count, report, load()

#include <atomic>
#include <cstdint>
#include <optional>

#include "firmware/core/board.hpp"
#include "firmware/core/planner.hpp"
#include "firmware/core/ring.hpp"

namespace diastole::firmware {

/// What on_match() tells the main loop: an event of the motion that the host must hear of.
struct MotionReport {
  Ticks tick;
  std::uint16_t flags = 0;  ///< MotionEvent::Flag
};

struct MotionCounters {
  Steps position;
  std::uint64_t steps = 0;
  std::uint32_t triggers = 0;  ///< since reset
  std::uint32_t r_waves = 0;
  std::uint32_t cycles_begun = 0;  ///< in this run
  std::uint32_t cycles_done = 0;
};

template <Board B>
class StepEngine {
 public:
  static constexpr std::size_t kQueue = 512;
  static constexpr std::size_t kSamples = 512;
  /// An order must reach the timer this long before its tick, or the compare would be missed.
  static constexpr Ticks kLeastLead = microseconds(2);

  explicit StepEngine(B& board) : board_(board) {}

  /// Accepts events again after cut().
  void open() { closed_ = false; }
  [[nodiscard]] bool full() const { return queue_.full(); }
  void push(const MotionEvent& event) {
    typename B::InterruptLock lock(board_);
    if (closed_) return;
    queue_.push(event);
    if (!loaded_) load();
  }

  /// Compare interrupt: the loaded event has just happened on the pins.
  void on_match() {
    if (!loaded_) return;
    const MotionEvent event = *loaded_;
    loaded_.reset();
    sample_until(event.tick);
    count(event);
    load();
  }

  /// Cuts off everything that has not happened yet, and drops what is pushed until open(). Any context.
  void cut() {
    typename B::InterruptLock lock(board_);
    closed_ = true;
    board_.cancel_pulses();
    loaded_.reset();
    queue_.clear();
  }

  /// Starts the position stream at `first`; stop_sampling() ends it after the samples up to `last`.
  void begin_sampling(Ticks first, Ticks period) {
    typename B::InterruptLock lock(board_);
    samples_.clear();
    next_sample_ = first;
    sample_period_ = period;
    sampling_ = true;
  }
  void stop_sampling(Ticks last) {
    typename B::InterruptLock lock(board_);
    sample_until(last + Ticks{1});
    sampling_ = false;
  }
  /// Main loop: samples whose time has come although no step did.
  void sample_to_now() {
    typename B::InterruptLock lock(board_);
    const Ticks now = board_.now();
    sample_until(loaded_ && loaded_->tick < now ? loaded_->tick : now);
  }
  Ring<std::int32_t, kSamples>& samples() { return samples_; }
  Ring<MotionReport, 64>& reports() { return reports_; }

  [[nodiscard]] MotionCounters counters() const {
    typename B::InterruptLock lock(board_);
    return counters_;
  }
  void begin_counting_run() {
    typename B::InterruptLock lock(board_);
    counters_.cycles_begun = counters_.cycles_done = 0;
  }
  void set_position(Steps position) {
    typename B::InterruptLock lock(board_);
    counters_.position = position;
  }
  void set_ttl_width(Ticks width) { ttl_width_ = width; }

  /// An event came too late for the timer since the last call: motion has been cut off.
  bool take_underrun() { return underrun_.exchange(false); }
  /// Samples or reports that found their ring full since the last call.
  std::uint32_t take_lost() { return lost_.exchange(0); }

 private:
  void load() {
    const MotionEvent* next = queue_.front();
    if (next == nullptr) return;
    if (next->tick < board_.now() + kLeastLead) {
      underrun_ = true;
      cut();
      return;
    }
    loaded_ = *next;
    queue_.pop();
    board_.schedule(PulseOrder{.tick = loaded_->tick,
                               .step = loaded_->has(MotionEvent::kStep),
                               .inflate = loaded_->has(MotionEvent::kInflate),
                               .ttl = loaded_->has(MotionEvent::kCycleStart),
                               .r_wave = loaded_->has(MotionEvent::kRWave),
                               .ttl_width = ttl_width_});
  }

  void count(const MotionEvent& event) {
    if (event.has(MotionEvent::kStep)) {
      counters_.position += Steps{event.has(MotionEvent::kInflate) ? 1 : -1};
      ++counters_.steps;
    }
    if (event.has(MotionEvent::kCycleStart)) {
      ++counters_.cycles_begun;
      ++counters_.triggers;
    }
    if (event.has(MotionEvent::kRWave)) ++counters_.r_waves;
    if (event.has(MotionEvent::kCycleEnd)) ++counters_.cycles_done;
    constexpr std::uint16_t kReported =
        MotionEvent::kCycleStart | MotionEvent::kRunStart | MotionEvent::kSegmentStart | MotionEvent::kEnd;
    if ((event.flags & kReported) != 0 && !reports_.push({event.tick, event.flags})) ++lost_;
  }

  /// Records the present position for every sample time before `tick`.
  void sample_until(Ticks tick) {
    if (!sampling_) return;
    for (; next_sample_ < tick; next_sample_ += sample_period_)
      if (!samples_.push(counters_.position.count)) ++lost_;
  }

  B& board_;
  Ring<MotionEvent, kQueue> queue_;
  std::optional<MotionEvent> loaded_;
  Ring<MotionReport, 64> reports_;
  Ring<std::int32_t, kSamples> samples_;
  MotionCounters counters_;
  Ticks ttl_width_;
  Ticks next_sample_;
  Ticks sample_period_;
  bool sampling_ = false;
  bool closed_ = false;
  std::atomic<bool> underrun_{false};
  std::atomic<std::uint32_t> lost_{0};
};

}  // namespace diastole::firmware
