#pragma once
// The parts of an Explanation that are read off fitted sets of effects: effects with intervals, places, shifts, traces.

#include <vector>

#include "estimator/explain/rig/set_verdict.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// The set's material effects with values and 90 % intervals, by value_errors.hpp.
std::vector<FoundEffect> found_effects(const rig::SessionProblem& problem, const EffectSet& set,
                                       const SetVerdict& verdict);

/// C1 and the sensors' offsets, without and with the set's effects.
std::vector<ParameterShift> parameter_shifts(const rig::SessionProblem& problem, const EffectSet& before,
                                             const EffectSet& after);

/// Windows of the session in which `set` leaves more than noise and the model's error of `under` allow, by false discovery
/// rate: one a channel and segment, the worst first. Each goes to the port of the largest effect of `under` or, if it has
/// none, to the port that the channel suggests.
std::vector<Misfit> misfits(const rig::SessionProblem& problem, const EffectSet& set, const EffectSet& under);

/// The place of a tone: where it is clearest, with what all of the session shows of it.
Misfit misfit_of(const rig::Tone& tone, const rig::Session& session);

/// The evidence table.
std::vector<Candidate> candidates(const EffectLibrary& known, const WeighedSets& search,
                                  const SetVerdict& verdict);

std::vector<Trace> traces(const rig::SessionProblem& problem, const EffectSet& before,
                          const EffectSet& after);

}  // namespace diastole::explain
