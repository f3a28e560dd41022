#pragma once
// From a motion asked for to the engine's queue: one motion at a time, planned and with its play taken up, handed over
// kHorizon ahead of its time. A stop begins behind what has been handed over.
//
//   Planner ──▶ BacklashCompensation (if the motion takes up play) ──refill()──▶ StepEngine

#include <utility>

#include "firmware/core/backlash_compensation.hpp"
#include "firmware/core/planner.hpp"
#include "firmware/core/program_store.hpp"
#include "firmware/core/step_engine.hpp"

namespace diastole::firmware {

template <Board B>
class StepFeed {
 public:
  /// Steps are handed to the engine this long before their time; a main loop that stalls longer is an
  /// underrun.
  static constexpr Ticks kHorizon = microseconds(10'000);

  explicit StepFeed(StepEngine<B>& engine) : engine_(engine) {}

  void begin_run(const ProgramStore& store, Ticks start, Steps position) {
    planner_.begin_run(store.program(), store.settings(), start, position);
    compensate(store, store.compensation_window(), start);
    stopping_ = false;
  }
  /// From rest to rest, without regard to play.
  void begin_move(bool inflate, const RestToRestMove& move, Ticks start) {
    planner_.begin_move(inflate, move, start);
    compensating_ = stopping_ = false;
  }
  /// As begin_move(), with the play taken up where the position, and so the side on which it lies, is known.
  void begin_jog(const ProgramStore& store, bool inflate, const RestToRestMove& move, Ticks start,
                 bool position_known) {
    begin_move(inflate, move, start);
    if (!position_known) return;
    const Settings& settings = store.settings();
    compensate(store,
               microseconds(compensation_window_us(store.backlash_steps(), settings.stop_steps_per_s2() / 4,
                                                   settings)),
               start);
  }

  /// Comes to rest under control; once in a motion.
  void stop(Ticks now, const Settings& settings) {
    if (std::exchange(stopping_, true)) return;
    planner_.begin_stop(now + microseconds(1'000), settings.stop_steps_per_s2(),
                        compensating_ && compensation_.turning());
  }
  [[nodiscard]] bool stopping() const { return stopping_; }
  void stop_at_cycle_end() { planner_.stop_at_cycle_end(); }
  /// Forgets everything planned.
  void clear() {
    planner_.clear();
    compensating_ = false;
  }
  /// The present place is position 0, and the play on the side of inflating.
  void home() {
    engine_.set_position(Steps{0});
    compensation_.home();
  }

  /// Main loop: hands over what is due within kHorizon.
  void refill(Ticks now) {
    const Ticks until = now + kHorizon;
    if (compensating_) return refill_compensated(until);
    for (const MotionEvent* next = planner_.peek(); next != nullptr; next = planner_.peek()) {
      if (next->tick > until || engine_.full()) return;
      engine_.push(*next);
      planner_.pop();
    }
  }

 private:
  void compensate(const ProgramStore& store, Ticks window, Ticks start) {
    compensating_ = store.backlash_steps() > 0;
    const std::uint32_t rate_Hz = store.settings().limits().step_rate_Hz;
    compensation_.begin(store.backlash_steps(), window, Ticks{(kTicksPerSecond + rate_Hz - 1) / rate_Hz},
                        start);
  }
  void refill_compensated(Ticks until) {
    while (!engine_.full()) {
      const MotionEvent* next = compensation_.merge(planner_.peek());
      if (next == nullptr || next->tick > until) return;
      engine_.push(*next);
      if (compensation_.pop()) planner_.pop();
    }
  }

  StepEngine<B>& engine_;
  Planner planner_;
  BacklashCompensation compensation_;
  bool compensating_ = false;
  bool stopping_ = false;
};

}  // namespace diastole::firmware
