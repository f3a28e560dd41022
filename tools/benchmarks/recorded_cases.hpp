#pragma once
// The labelled recordings that a bench goes through: `[folder] [case or kind ...]` on its command line.

#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace diastole::bench {

struct Recordings {
  std::filesystem::path folder;
  nlohmann::json labels;            ///< of labels.json
  std::vector<std::string> wanted;  ///< names and kinds; empty: all
};

/// By default of shared/data/rig beside the tree and no part of it. None, and a line that says so, without a labels.json
/// or where an option is asked for.
std::optional<Recordings> recordings_of(int argc, char** argv);

struct RecordedCase {
  std::string name;
  std::filesystem::path study;
  const nlohmann::json& label;
};

/// Calls `visit` for each wanted case. Precondition: `labels` holds one entry a case.
void visit_cases(const Recordings& recordings, const std::function<void(const RecordedCase&)>& visit);

}  // namespace diastole::bench
