#include "tools/benchmarks/recorded_cases.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>

namespace diastole::bench {

std::optional<Recordings> recordings_of(int argc, char** argv) {
  if (argc > 1 && argv[1][0] == '-') {
    fmt::print("usage: {} [folder with a labels.json] [case or kind ...]\n",
               std::filesystem::path(argv[0]).filename().string());
    return std::nullopt;
  }
  Recordings found{
      .folder = argc > 1 ? std::filesystem::path(argv[1])
                         : std::filesystem::path(DIASTOLE_SOURCE_DIR).parent_path() / "shared/data/rig",
      .labels = {},
      .wanted = {argv + std::min(argc, 2), argv + argc},
  };
  std::ifstream file(found.folder / "labels.json");
  if (!file) {
    fmt::print("skipped: no labels.json in {}\n", found.folder.string());
    return std::nullopt;
  }
  found.labels = nlohmann::json::parse(file);
  return found;
}

void visit_cases(const Recordings& recordings, const std::function<void(const RecordedCase&)>& visit) {
  const auto& labels = recordings.labels;
  for (const auto& [name, label] : (labels.contains("cases") ? labels["cases"] : labels).items()) {
    const std::string& id = name;
    const std::string kind = label["kind"];
    const bool chosen = recordings.wanted.empty() ||
                        std::any_of(recordings.wanted.begin(), recordings.wanted.end(),
                                    [&](const std::string& word) { return word == id || word == kind; });
    if (chosen) visit({name, recordings.folder / name / (name + ".study.toml"), label});
  }
}

}  // namespace diastole::bench
