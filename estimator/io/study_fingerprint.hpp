#pragma once
// Distinguishes results of one study from those of another, wherever the files lie and whatever they are called.

#include <string>

#include "estimator/io/study.hpp"

namespace diastole {

/// Eight hexadecimal digits that change with the study's file, with any file of its data, and with the mesh and
/// smoothness that a command line may have set instead. Start values and truths are not among it.
std::string study_fingerprint(const Study& study);

}  // namespace diastole
