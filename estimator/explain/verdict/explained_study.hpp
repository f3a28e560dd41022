#pragma once
// The study with the effects that were found: the same file with [model] effects and their parameters, its paths
// rewritten for the folder that it is written to.

#include <filesystem>
#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/io/study.hpp"

namespace diastole::explain {

/// TOML text. `folder`: where it will stand. Law parameters that were refitted (`starts`) get new starts.
std::string explained_study(const Study& study, const std::filesystem::path& folder,
                            const std::vector<FoundEffect>& effects,
                            const std::vector<ParameterShift>& starts);

}  // namespace diastole::explain
