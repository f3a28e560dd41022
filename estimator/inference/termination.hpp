#pragma once
// Why a search ended. Only a settled one has an estimate whose errors mean anything.

#include <string_view>

namespace diastole::inference {

enum class Termination {
  converged,        ///< no step is worth taking, and no bound is in the way
  on_bound,         ///< the same, but the cost still falls beyond a bound
  stalled,          ///< the cost has a slope, but no step lowers it by what it promises
  iteration_limit,  ///< the cost was still falling
  interrupted,      ///< ended on request
  no_solution       ///< the model has no solution at the start
};

/// Whether a search ended where it was to end: converged or on_bound.
bool is_settled(Termination termination);

/// How that ended which rests on two searches: as the first of them that did not settle, or as the first.
Termination of_both(Termination first, Termination second);

/// A sentence for a person.
std::string_view sentence(Termination termination);

}  // namespace diastole::inference
