#pragma once
// What a learned curve looks like: the simplest formula that its band admits, words for a person, and the effect file.

#include "estimator/explain/rig/port_law.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// Sets closed_form, readings and toml of a term with a curve and its band.
///
/// Formulas are tried from the simplest on: none, a line, a square, saturation, a threshold, one side alone. One is taken if it lies
/// within the band at every knot. Its first parameter is the curve's size, the second where it bends.
void read_law(const PortLaw& law, LearnedTerm& term);

}  // namespace diastole::explain
