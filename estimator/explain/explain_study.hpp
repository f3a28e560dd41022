#pragma once
// `diastole explain`: a study's runs, its imaged motion, or both.

#include "estimator/explain/rig/explain_rig.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// Throws InputError if the study names neither runs nor tags or points, and what explain_rig and explain_field throw.
Explanation explain_study(const Study& study, const ExplainOptions& options);

// Runs and images of one study are explained together. The images come first: what they say of the modulus, with the effects that
// they name, is a measurement of it for the runs, so that there is one C1. An effect that shows in both is then judged by both: sets
// that only one of them leaves open are closed by the other.

/// The study as the runs see it, with the modulus as well known as the images determine it, if that is better than the study states.
/// Unchanged where the images are unexplained or ambiguous.
Study with_imaged_modulus(Study study, const Explanation& field);

/// Effects of both, a value that both estimate as the better known one; named only if both agree that nothing else is open.
Explanation merged(Explanation rig, Explanation field);

}  // namespace diastole::explain
