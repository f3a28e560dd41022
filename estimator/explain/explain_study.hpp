#pragma once
// `diastole explain`: a study's runs, its imaged motion, or both.

#include "estimator/explain/rig/explain_rig.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// Throws InputError if the study names neither runs nor tags or points, and what explain_rig and explain_field throw.
Explanation explain_study(const Study& study, const ExplainOptions& options);

/// What recordings of the rig and images of the specimen say together: the effects of both, named only if both agree
/// that nothing else is open.
Explanation merged(Explanation rig, Explanation field);

}  // namespace diastole::explain
