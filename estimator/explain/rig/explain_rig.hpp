#pragma once
// `diastole explain` for the runs of a rig: where the rig's model and the recordings disagree, what is missing, and
// what remains open.
//
//   read the session -> features of its segments (rig_fit) -> what the rig's references say of its tolerances and of the
//   model's own error -> evidence of sets of effects (effect_sets) -> verdict (set_verdict) -> what is reported (findings)

#include <functional>
#include <string>

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// What `progress` throws to end the work. Once there is a verdict it is returned, with what was found until then.
struct Interrupted {};

struct ExplainOptions {
  size_t threads = 2;
  bool propose = true;  ///< a next experiment
  /// A law beside what was found, too, but where nothing is missing; where that is unexplained always.
  bool learn = false;
  std::function<void(const std::string&)>
      progress;  ///< a line for people; empty text: only asks whether to go on

  void report(const std::string& text) const {
    if (progress) progress(text);
  }
};

/// Throws InputError for runs that cannot be read, and Interrupted before there is a verdict.
Explanation explain_rig(const Study& study, const ExplainOptions& options);

}  // namespace diastole::explain
