#pragma once
// A learned term, where the library ends: the law at a port (port_law.hpp) that predicts waveforms it was not fitted to.
//
// Each law's curve is fitted (law_fit.hpp) beside all nuisances; those that promise most are linearised again where they
// fit. Then each run in turn (of a single run: each segment) is predicted from the others, with sizes, smoothness and the
// model's error of those others; where the features are linearised is from all runs. What a law gains there is the logarithm
// of a likelihood ratio, whose mean over data in which nothing is missing is one whatever was fitted before: an e-value.
// Their mean over the runs is one too, however they hang together, and by Markov's inequality J/alpha is exceeded by the best
// of J laws in a part alpha of such sessions at most (Vovk and Wang 2021). This bound is approximate: it takes the laws as
// linear about that point, and the shares of the error, which are estimated, as known. The model without the law has its own
// error, which grows to what the other runs show: a law has to do better than a smooth discrepancy of any size. A law is
// proposed if
//
//   - the search for its curve settled (LawSearch::refine), and those of the error's shares in all of its fits,
//   - that mean is larger than J/alpha, alpha one in a hundred, and most of the runs gain,
//   - what it changes is as large as an effect has to be for a name, and no tolerance (set_verdict.hpp),
//   - it closes half of the gap on what was not fitted: what leaves more is not the law. For the gap only the linear values
//     are fitted to the others alone: size and smoothness of the curve, which increments are there, and where it is
//     linearised are of all runs.

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "estimator/explain/rig/set_verdict.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

struct Learning {
  std::optional<LearnedTerm>
      term;  ///< nothing where no law is proposed, or where there is no other waveform to judge it on
  std::string lacks;  ///< why there is none: "the best, p_pump by q_hose, closes 30 % ..."
};

/// Beside the effects of `set`. `progress` is called with what is done, and with nothing every few simulations; what it throws
/// ends the search. `most_rounds`: how often a law is linearised again.
Learning learn_term(const rig::SessionProblem& problem, const EffectSet& set, const ErrorKnowledge& known,
                    const std::function<void(std::string_view)>& progress = {}, int most_rounds = 4);

}  // namespace diastole::explain
