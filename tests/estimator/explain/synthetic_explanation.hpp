#pragma once
// Explanations as the engine would hand them over, without a rig: pressures with a made-up effect, tags with an inclusion.

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::test {

/// A named hose-compliance on two runs, with everything that the report draws of a rig.
explain::Explanation explained_hose();
/// A named stiff inclusion at 60 degrees, seen by tags only.
explain::Explanation explained_inclusion();

}  // namespace diastole::test
