#pragma once
// The part of `tools/bench explain` for folders of imaged motion: NAME.study.toml and NAME-shear.study.toml beside a
// labels.json (docs/explain-field.md).

#include <filesystem>
#include <string>
#include <vector>

namespace diastole::bench {

/// Explains the studies of all truths in `folder` whose name or kind is among `wanted` (empty: of all), prints a few lines of
/// each and keeps the explanations as KEPT/NAME.json.
void explain_imaged_motion(const std::filesystem::path& folder, const std::vector<std::string>& wanted,
                           const std::filesystem::path& kept);

}  // namespace diastole::bench
