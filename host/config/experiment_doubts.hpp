#pragma once
// What is allowed in an experiment file, and hardly meant.

#include <string>
#include <vector>

#include "host/config/experiment.hpp"

namespace diastole {

/// One sentence for each, with what may have been meant.
std::vector<std::string> doubts_about(const Experiment& experiment);

}  // namespace diastole
