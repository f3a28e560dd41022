#pragma once
// The interrupt path: takes planned events from the queue, gives them to the timer one by one, and counts
// what the timer has done. push() and the telemetry belong to the main loop, on_match() to the compare
// interrupt. Times are the lower halves of ticks here: the queue spans milliseconds.
//
//   Planner ──push()──▶ queue ──load()──▶ Board::schedule ──edge──▶ on_match(): load(), sample, count

#include <atomic>
#include <cstdint>
#include <utility>

#include "firmware/core/board.hpp"
#include "firmware/core/planner.hpp"
#include "firmware/core/ring.hpp"

namespace diastole::firmware {

/// What on_match() reports to the main loop: an event of the motion that the host must hear of.
struct MotionReport {
  Ticks tick;
  std::uint16_t flags = 0;  ///< MotionEvent::Flag
};

struct MotionCounters {
  Steps position;           ///< of the load, as commanded
  Steps motor_beside_load;  ///< the motor stands at the sum: less by the play while withdrawing
  std::uint64_t steps = 0;
  std::uint32_t triggers = 0;       ///< seen to rise since reset
  std::uint32_t triggers_lost = 0;  ///< due and not seen
  std::uint32_t r_waves = 0;
  std::uint32_t cycles_begun = 0;  ///< in this run
  std::uint32_t cycles_done = 0;
};

/// Shared with the interrupts of the same core, which needs no barrier.
class Flag {
 public:
  Flag& operator=(bool value) {
    value_.store(value, std::memory_order_relaxed);
    return *this;
  }
  operator bool() const { return value_.load(std::memory_order_relaxed); }

 private:
  std::atomic<bool> value_{false};
};

template <Board B>
class StepEngine {
 public:
  static constexpr std::size_t kQueue = 512;
  static constexpr std::size_t kSamples = 512;
  /// An order must reach the timer this long before its tick, or the compare would be missed: 1 µs, 168 core cycles.
  static constexpr Ticks kLeastLead{84};
  /// … and one that starts a cycle, for which the board prepares TTL and R-wave first.
  static constexpr Ticks kTriggerLead = microseconds(2);

  explicit StepEngine(B& board) : board_(board) {}

  /// Accepts events again after cut().
  void open() {
    typename B::InterruptLock lock(board_);
    queue_.clear();
    closed_ = false;
  }
  [[nodiscard]] bool closed() const { return closed_; }
  [[nodiscard]] bool full() const { return queue_.full(); }
  void push(const MotionEvent& event) {
    if (closed_) return;
    queue_.push({lower_half(event.tick), event.flags});
    std::atomic_signal_fence(std::memory_order_seq_cst);
    if (!loaded_) load_first();
  }

  /// Compare interrupt: the loaded event is happening on the pins. The next comes first, the counting can wait.
  void on_match() {
    if (!loaded_) return;
    const Queued event = event_;
    load();
    sample_until(event.tick);
    count(event);
  }

  /// Cuts off everything that has not happened yet, and drops what is pushed until open(). Any context.
  void cut() {
    typename B::InterruptLock lock(board_);
    closed_ = true;
    settle_trigger(lower_half(board_.now()));
    trigger_ = {};
    board_.cancel_pulses();
    loaded_ = false;
    queue_.clear();
  }

  /// Starts the position stream at `first`; stop_sampling() ends it after the samples up to `last`.
  void begin_sampling(Ticks first, Ticks period) {
    typename B::InterruptLock lock(board_);
    samples_.clear();
    next_sample_ = lower_half(first);
    sample_period_ = lower_half(period);
    sampling_ = true;
  }
  void stop_sampling(Ticks last) {
    typename B::InterruptLock lock(board_);
    sample_until(lower_half(last + Ticks{1}));
    sampling_ = false;
  }
  /// Main loop: samples whose time has come although no step did.
  void sample_to_now() {
    typename B::InterruptLock lock(board_);
    const std::uint32_t now = lower_half(board_.now());
    sample_until(loaded_ && ticks_between(event_.tick, now) > 0 ? event_.tick : now);
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
    counters_.motor_beside_load = Steps{0};
  }
  /// How the TTL follows the first step of a cycle. Precondition: delay is 0 or at least kLeastTriggerDelay_us.
  void set_trigger(Ticks width, Ticks delay) {
    typename B::InterruptLock lock(board_);
    ttl_width_ = width;
    trigger_delay_ = lower_half(delay);
    trigger_ = {};
  }
  /// Main loop: counts and reports a delayed TTL that has risen by now.
  void settle_trigger() {
    typename B::InterruptLock lock(board_);
    settle_trigger(lower_half(board_.now()));
  }
  /// A delayed TTL that has not risen yet does not. Precondition: nothing moves.
  void drop_trigger() {
    typename B::InterruptLock lock(board_);
    settle_trigger(lower_half(board_.now()));
    if (trigger_.flags != 0) board_.cancel_pulses();
    trigger_ = {};
  }

  /// An event came too late for the timer since the last call: motion has been cut off.
  bool take_underrun() { return underrun_.exchange(false); }
  /// Samples or reports that found their ring full since the last call.
  std::uint32_t take_lost() { return lost_.exchange(0); }

 private:
  /// A MotionEvent in the queue.
  struct Queued {
    std::uint32_t tick = 0;
    std::uint16_t flags = 0;

    [[nodiscard]] bool has(MotionEvent::Flag flag) const { return (flags & flag) != 0; }
  };
  static constexpr std::uint16_t kTrigger = MotionEvent::kCycleStart | MotionEvent::kRWave;
  static constexpr std::uint16_t kStepOnly = MotionEvent::kStep | MotionEvent::kInflate;

  void load_first() {
    typename B::InterruptLock lock(board_);
    if (!loaded_ && !closed_) load();
  }

  /// Hands the next event to the timer. With the interrupts locked, or in them.
  void load() {
    const Queued* next = queue_.front();
    loaded_ = next != nullptr;
    if (next == nullptr) return board_.rest();
    const Ticks lead = next->has(MotionEvent::kCycleStart) ? kTriggerLead : kLeastLead;
    if (board_.ticks_until(next->tick) < lead.count) {
      underrun_ = true;
      return cut();
    }
    event_ = *next;
    queue_.pop();
    board_.schedule(PulseOrder{.tick = event_.tick,
                               .step = event_.has(MotionEvent::kStep),
                               .inflate = event_.has(MotionEvent::kInflate),
                               .ttl = event_.has(MotionEvent::kCycleStart) && trigger_delay_ == 0,
                               .r_wave = event_.has(MotionEvent::kRWave) && trigger_delay_ == 0,
                               .ttl_width = ttl_width_});
  }

  void count(const Queued& event) {
    if (event.has(MotionEvent::kStep)) {
      counters_.position += Steps{event.has(MotionEvent::kInflate) ? 1 : -1};
      ++counters_.steps;
    }
    if ((event.flags & ~kStepOnly) != 0) mark(event);
  }

  /// Beginnings and ends: a few in a cycle.
  void mark(const Queued& event) {
    if (event.has(MotionEvent::kBacklash)) {  // count() has taken it for a step of the load
      const Steps way{event.has(MotionEvent::kInflate) ? 1 : -1};
      counters_.position -= way;
      counters_.motor_beside_load += way;
      return;
    }
    settle_trigger(event.tick);
    if (event.has(MotionEvent::kCycleStart)) ++counters_.cycles_begun;
    if (event.has(MotionEvent::kCycleEnd)) ++counters_.cycles_done;
    if (event.has(MotionEvent::kCycleStart) && trigger_delay_ != 0) {
      trigger_ = {event.tick + trigger_delay_, static_cast<std::uint16_t>(event.flags & kTrigger)};
      board_.schedule_trigger(trigger_.tick, ttl_width_, trigger_.has(MotionEvent::kRWave));
      return report({event.tick, static_cast<std::uint16_t>(event.flags & ~kTrigger)});
    }
    report_trigger(event);
  }

  /// The event, with its TTL counted if the board saw it rise, and then at that tick; else with its loss. One that rose as
  /// ordered goes with the rest of the event, as most do.
  [[gnu::noinline]] void report_trigger(const Queued& event) {
    if (!event.has(MotionEvent::kCycleStart)) return report(event);
    const auto rise = board_.ttl_rise(event.tick);
    if (rise) {
      ++counters_.triggers;
      if (event.has(MotionEvent::kRWave)) ++counters_.r_waves;
      if (*rise == event.tick) return report(event);
    } else {
      ++counters_.triggers_lost;
    }
    report({event.tick, static_cast<std::uint16_t>(event.flags & ~kTrigger)});
    if (rise)
      report({*rise, static_cast<std::uint16_t>(event.flags & kTrigger)});
    else
      report({event.tick, MotionEvent::kTriggerLost});
  }

  /// The delayed trigger counts and is reported once it has risen.
  void settle_trigger(std::uint32_t now) {
    if (trigger_.flags == 0 || ticks_between(trigger_.tick, now) < 0) return;
    report_trigger(std::exchange(trigger_, {}));
  }

  void report(const Queued& event) {
    constexpr std::uint16_t kReported = MotionEvent::kCycleStart | MotionEvent::kTriggerLost |
                                        MotionEvent::kRunStart | MotionEvent::kSegmentStart |
                                        MotionEvent::kEnd;
    if ((event.flags & kReported) == 0) return;
    if (!reports_.push({whole_time(event.tick, board_.now()), event.flags})) ++lost_;
  }

  /// Records the present position for every sample time before `tick`.
  void sample_until(std::uint32_t tick) {
    if (!sampling_) return;
    for (; ticks_between(next_sample_, tick) > 0; next_sample_ += sample_period_)
      if (!samples_.push(counters_.position.count)) ++lost_;
  }

  B& board_;
  Ring<Queued, kQueue> queue_;
  Queued event_;  ///< what the timer will do next, while loaded_
  Ring<MotionReport, 64> reports_;
  Ring<std::int32_t, kSamples> samples_;
  MotionCounters counters_;
  Ticks ttl_width_;
  std::uint32_t trigger_delay_ = 0;  ///< 0: the TTL rises with the cycle's first step
  Queued trigger_;                   ///< a delayed one that has not risen; no flags: there is none
  std::uint32_t next_sample_ = 0;
  std::uint32_t sample_period_ = 0;
  bool sampling_ = false;
  Flag loaded_;
  Flag closed_;
  std::atomic<bool> underrun_{false};
  std::atomic<std::uint32_t> lost_{0};
};

}  // namespace diastole::firmware
