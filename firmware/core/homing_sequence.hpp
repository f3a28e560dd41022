#pragma once
// Carries the stages of homing.hpp out, one move after the other: which stage is on, what its end means.

#include "firmware/core/homing.hpp"
#include "firmware/core/input_watch.hpp"
#include "firmware/core/program_store.hpp"
#include "firmware/core/step_feed.hpp"

namespace diastole::firmware {

template <Board B>
class HomingSequence {
 public:
  /// What the end of a stage leads to.
  enum class Outcome : std::uint8_t { going_on, homed, stopped, not_found, switch_stuck };

  HomingSequence(B& board, StepEngine<B>& engine, StepFeed<B>& feed, InputWatch<B>& inputs,
                 const ProgramStore& store)
      : board_(board), engine_(engine), feed_(feed), inputs_(inputs), store_(store) {}

  void begin() { begin_stage(board_.inputs().home ? HomingStage::back_off : HomingStage::seek); }

  /// A controlled stop begins: the switch may just have cut a stage off, and must not cut the stop off.
  void stop() {
    stage_ = HomingStage::stopped;
    if (inputs_.watching() == Watch::approach_home) inputs_.watch(Watch::rest);
    if (inputs_.watching() == Watch::leave_home) inputs_.watch(Watch::inflating);
    if (engine_.closed()) engine_.open();
  }
  void forget() { stage_ = HomingStage::done; }

  /// Main loop, while homing. Where the switch has changed: from the fast stages to rest (end_stage goes on); the slow
  /// ones are cut off already.
  void turn() {
    const bool closed = board_.inputs().home;
    if (stage_ == HomingStage::seek ? closed : stage_ == HomingStage::back_off && !closed) {
      feed_.stop(board_.now(), store_.settings());
    } else if (stage_ == HomingStage::approach && closed) {
      begin_stage(HomingStage::leave);
    } else if (stage_ == HomingStage::leave && !closed) {
      begin_stage(HomingStage::clearance);
    }
  }

  /// A stage's move has come to its end.
  Outcome end_stage() {
    switch (stage_) {
      case HomingStage::seek:
        return feed_.stopping() ? begin_stage(HomingStage::back_off) : Outcome::not_found;
      case HomingStage::back_off:
        return feed_.stopping() ? begin_stage(HomingStage::approach) : Outcome::switch_stuck;
      case HomingStage::approach:
        return Outcome::not_found;
      case HomingStage::leave:
        return Outcome::switch_stuck;
      case HomingStage::clearance:
        feed_.home();
        return Outcome::homed;
      default:
        return Outcome::stopped;
    }
  }

 private:
  Outcome begin_stage(HomingStage stage) {
    stage_ = stage;
    const bool withdraws_from_far = stage == HomingStage::seek && board_.inputs().far_limit;
    inputs_.watch(withdraws_from_far               ? Watch::rest
                  : stage == HomingStage::approach ? Watch::approach_home
                  : stage == HomingStage::leave    ? Watch::leave_home
                                                   : Watch::inflating);
    const HomingMove move = homing_move(stage, store_.settings(), store_.backlash_steps());
    engine_.open();
    feed_.begin_move(move.inflate, move.move, board_.now() + kHomingPause);
    return Outcome::going_on;
  }

  B& board_;
  StepEngine<B>& engine_;
  StepFeed<B>& feed_;
  InputWatch<B>& inputs_;
  const ProgramStore& store_;
  HomingStage stage_ = HomingStage::done;
};

}  // namespace diastole::firmware
