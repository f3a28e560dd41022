#include "tests/layering/layers.hpp"

#include <algorithm>
#include <fstream>
#include <map>
#include <regex>
#include <set>

namespace diastole::layering {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view source_folders[] = {"protocol", "firmware", "host", "estimator", "tools", "tests"};

bool lies_in(std::string_view path, std::string_view folder) {
  return path.starts_with(folder) && (path.size() == folder.size() || path[folder.size()] == '/');
}

bool is_project_path(std::string_view included) {
  return std::any_of(std::begin(source_folders), std::end(source_folders),
                     [&](std::string_view folder) { return lies_in(included, folder); });
}

bool allowed(std::string_view file, std::string_view included) {
  for (const Rule& rule : rules()) {
    if (!lies_in(file, rule.folder)) continue;
    return lies_in(included, rule.folder) ||
           std::any_of(rule.may_include.begin(), rule.may_include.end(),
                       [&](std::string_view folder) { return lies_in(included, folder); });
  }
  return false;
}

std::vector<Include> includes_of(const fs::path& root, const fs::path& path) {
  static const std::regex include_line(R"re(^\s*#\s*include\s*"([^"]+)")re");
  std::vector<Include> found;
  std::ifstream stream(path);
  std::string text;
  for (int line = 1; std::getline(stream, text); ++line)
    if (std::smatch match; std::regex_search(text, match, include_line))
      found.push_back({fs::relative(path, root).generic_string(), line, match[1].str()});
  return found;
}

/// Of all sources under `root`.
std::vector<Include> all_includes(const fs::path& root) {
  std::vector<Include> found;
  for (const std::string_view folder : source_folders) {
    if (!fs::exists(root / folder)) continue;
    for (const auto& entry : fs::recursive_directory_iterator(root / folder)) {
      const auto extension = entry.path().extension();
      if (extension != ".hpp" && extension != ".cpp" && extension != ".h" && extension != ".inc") continue;
      const std::vector<Include> of_file = includes_of(root, entry.path());
      found.insert(found.end(), of_file.begin(), of_file.end());
    }
  }
  return found;
}

std::string folder_of(const std::string& file) { return fs::path(file).parent_path().generic_string(); }

using Graph = std::map<std::string, std::set<std::string>>;  // folders by the one that includes them

/// Extends `reached` by all that is included from `from`, directly or through others.
void reach(const Graph& graph, const std::string& from, std::set<std::string>& reached) {
  const auto next = graph.find(from);
  if (next == graph.end()) return;
  for (const std::string& folder : next->second)
    if (reached.insert(folder).second) reach(graph, folder, reached);
}

}  // namespace

const std::vector<Rule>& rules() {
  static const std::vector<Rule> list{
      {"protocol/wire", {}},
      {"protocol/signing", {"protocol/wire"}},
      {"protocol/contract", {}},
      {"protocol/signal", {"protocol/contract"}},
      {"protocol/runfile", {"protocol/contract", "protocol/signal"}},
      {"firmware/core/arithmetic", {}},
      {"firmware/core/profiles", {"protocol/wire", "firmware/core/arithmetic"}},
      {"firmware/core/uploaded", {"protocol/wire", "firmware/core/arithmetic"}},
      {"firmware/core", {"protocol/wire"}},
      {"firmware/boards/recording", {"protocol/wire", "firmware/core"}},
      {"firmware/boards/stm32f405/bootloader",
       {"protocol/wire", "firmware/boards/stm32f405", "firmware/boot"}},
      {"firmware/boards/stm32f405", {"protocol/wire", "firmware/core", "firmware/boot"}},
      {"firmware/boot", {"protocol/signing", "protocol/wire"}},
      {"host/transport", {"protocol"}},
      {"host/journal", {"protocol", "host/transport"}},
      {"host/daq", {"protocol", "host/transport"}},
      {"host/gpio", {"protocol", "host/transport"}},
      {"host/config", {"protocol", "host/daq", "host/gpio"}},
      {"host/controller", {"protocol", "host/config", "host/transport"}},
      {"host/flash", {"protocol", "host/transport"}},
      {"host/acquisition",
       {"protocol", "host/config", "host/controller", "host/daq", "host/gpio", "host/journal",
        "host/transport"}},
      {"host/calibration",
       {"protocol", "host/acquisition", "host/config", "host/controller", "host/transport"}},
      {"host/runfile", {"protocol", "host/acquisition", "host/controller", "host/journal", "host/transport"}},
      {"host/rig",
       {"protocol", "host/acquisition", "host/calibration", "host/config", "host/controller", "host/daq",
        "host/journal", "host/runfile", "host/transport"}},
      {"host/rpc",
       {"protocol", "host/acquisition", "host/config", "host/controller", "host/journal", "host/rig",
        "host/runfile", "host/transport"}},
      {"host/web", {"protocol", "host/rpc"}},
      {"host/doctor", {"protocol", "host/config", "host/daq", "host/transport"}},
      {"host/daemon", {"protocol", "host/config", "host/rig", "host/rpc", "host/transport", "host/web"}},
      {"host/cli",
       {"protocol", "host/config", "host/controller", "host/daemon", "host/doctor", "host/flash",
        "host/journal", "host/rpc", "host/runfile", "host/transport"}},
      {"estimator/parallel", {}},
      {"estimator/sparse", {}},
      {"estimator/expressions", {"protocol/contract"}},
      {"estimator/effect_files", {"protocol/contract", "estimator/expressions"}},
      {"estimator/materials", {"protocol/contract", "estimator/expressions"}},
      {"estimator/inference", {"protocol/contract"}},
      {"estimator/mesh", {"protocol/contract"}},
      {"estimator/io", {"protocol/contract", "protocol/runfile", "estimator/inference/termination.hpp"}},
      {"estimator/grids", {"protocol/contract", "protocol/runfile", "estimator/io"}},
      {"estimator/rig", {"protocol/runfile", "estimator/inference"}},
      {"estimator/fe", {"estimator/materials", "estimator/mesh", "estimator/parallel", "estimator/sparse"}},
      {"estimator/effects",
       {"protocol/contract", "estimator/effect_files", "estimator/expressions", "estimator/inference",
        "estimator/rig"}},
      {"estimator/model",
       {"protocol/contract", "protocol/runfile", "estimator/effects", "estimator/fe", "estimator/io",
        "estimator/materials", "estimator/mesh", "estimator/rig"}},
      {"estimator/motion_residuals", {"estimator/io", "estimator/mesh", "estimator/parallel"}},
      {"estimator/solution", {"estimator/fe", "estimator/grids", "estimator/io", "estimator/mesh"}},
      {"estimator/imaging/dicom", {"protocol/contract"}},
      {"estimator/imaging/series",
       {"protocol/contract", "protocol/signal", "estimator/imaging/dicom", "estimator/io",
        "estimator/parallel"}},
      {"estimator/imaging/tracking",
       {"protocol/contract", "protocol/signal", "estimator/imaging/dicom", "estimator/imaging/series",
        "estimator/io", "estimator/parallel"}},
      {"estimator/imaging/flow",
       {"protocol/contract", "protocol/runfile", "protocol/signal", "estimator/imaging/dicom",
        "estimator/imaging/series", "estimator/io", "estimator/parallel"}},
      {"estimator/imaging/geometry",
       {"protocol/contract", "protocol/signal", "estimator/fe/face_points.hpp",
        "estimator/fe/gauss_points.hpp", "estimator/imaging/dicom", "estimator/imaging/series",
        "estimator/io", "estimator/mesh", "estimator/parallel"}},
      {"estimator/imaging/diffusion",
       {"protocol/contract", "protocol/signal", "estimator/imaging/dicom", "estimator/imaging/series",
        "estimator/io", "estimator/mesh", "estimator/parallel", "estimator/sparse"}},
      {"estimator/shear", {"protocol/contract", "estimator/inference", "estimator/io"}},
      {"estimator/law_fit",
       {"protocol/contract", "estimator/inference", "estimator/io", "estimator/materials",
        "estimator/parallel", "estimator/shear"}},
      {"estimator/catheter", {"protocol/signal", "estimator/inference"}},
      {"estimator/fit",
       {"protocol/contract", "protocol/signal", "estimator/effects", "estimator/fe", "estimator/inference",
        "estimator/io", "estimator/mesh", "estimator/model", "estimator/motion_residuals",
        "estimator/parallel", "estimator/solution"}},
      {"estimator/reconstruction",
       {"protocol/contract", "protocol/signal", "estimator/fe", "estimator/inference", "estimator/io",
        "estimator/mesh", "estimator/model", "estimator/motion_residuals", "estimator/parallel",
        "estimator/solution", "estimator/sparse"}},
      {"estimator/montecarlo",
       {"protocol/contract", "estimator/fit", "estimator/inference", "estimator/io", "estimator/mesh",
        "estimator/model", "estimator/motion_residuals"}},
      {"estimator/rig_fit",
       {"protocol/signal", "estimator/effects", "estimator/inference", "estimator/model",
        "estimator/parallel", "estimator/rig"}},
      {"estimator/explain/verdict",
       {"protocol/contract", "protocol/runfile", "estimator/inference", "estimator/io"}},
      {"estimator/explain/rig",
       {"protocol/contract", "protocol/runfile", "estimator/explain/verdict", "estimator/effect_files",
        "estimator/effects", "estimator/expressions", "estimator/inference", "estimator/io",
        "estimator/model", "estimator/parallel", "estimator/rig", "estimator/rig_fit"}},
      {"estimator/explain/imaging",
       {"protocol/contract", "estimator/explain/verdict", "estimator/effects", "estimator/fe",
        "estimator/fit", "estimator/inference", "estimator/io", "estimator/mesh", "estimator/model",
        "estimator/motion_residuals", "estimator/parallel"}},
      {"estimator/explain", {"protocol/contract", "estimator/effects", "estimator/io", "estimator/model"}},
      {"estimator/shaping",
       {"protocol/contract", "protocol/runfile", "estimator/effects", "estimator/inference", "estimator/io",
        "estimator/model", "estimator/parallel", "estimator/rig"}},
      {"estimator/report",
       {"protocol/contract", "protocol/runfile", "estimator/effects", "estimator/explain/verdict",
        "estimator/inference", "estimator/io", "estimator/law_fit", "estimator/montecarlo",
        "estimator/shear"}},
      {"estimator/cli",
       {"protocol/contract", "estimator/effects", "estimator/explain", "estimator/fe", "estimator/fit",
        "estimator/grids", "estimator/imaging", "estimator/inference", "estimator/io", "estimator/law_fit",
        "estimator/materials", "estimator/mesh", "estimator/model", "estimator/montecarlo",
        "estimator/reconstruction", "estimator/report", "estimator/shear", "estimator/solution"}},
      {"tools/program", {"protocol/contract"}},
      {"tools/sim_controller", {"protocol/contract"}},
      {"tools/sim_daq", {"protocol/contract", "tools/program"}},
      {"tools/sim_board/core", {"tools/sim_board/facts"}},
      {"tools/sim_board/peripherals", {"tools/sim_board/core"}},
      {"tools/sim_board/processor",
       {"protocol/contract", "tools/sim_board/core", "tools/sim_board/peripherals"}},
      {"tools/sim_board", {"protocol/contract", "firmware/core", "tools/program", "tools/sim_controller"}},
      {"tools/sim_rig/plant", {}},
      {"tools/sim_rig",  // of the estimator only what reads formulas: none of its physics
       {"protocol", "estimator/effect_files", "estimator/expressions", "firmware/core",
        "firmware/boards/recording", "host/transport", "tools/program", "tools/sim_board",
        "tools/sim_controller", "tools/sim_daq"}},
      {"tools/sim_scanner", {"protocol/contract", "estimator/mesh", "estimator/parallel"}},
      {"tools/diastole/scan",
       {"protocol/contract", "estimator/cli", "estimator/fe", "estimator/io", "estimator/mesh",
        "estimator/model", "tools/diastole/commands.hpp", "tools/sim_scanner"}},
      {"tools/diastole/desk",
       {"protocol/contract", "protocol/signal", "estimator/imaging", "estimator/io", "estimator/parallel",
        "estimator/report", "host/web", "tools/diastole/commands.hpp"}},
      {"tools/diastole/simulate",
       {"protocol/contract", "protocol/runfile", "host", "tools/diastole/commands.hpp", "tools/sim_rig"}},
      {"tools/diastole/replay",
       {"protocol", "host", "tools/diastole/commands.hpp", "tools/diastole/simulate", "tools/sim_rig"}},
      {"tools/diastole/shape",
       {"protocol", "firmware/core", "host", "estimator/io", "estimator/report", "estimator/shaping",
        "tools/diastole/commands.hpp", "tools/diastole/replay/replay_plan.hpp"}},
      {"tools/diastole/batch",
       {"protocol/contract", "estimator/cli/interruption.hpp", "estimator/io", "estimator/report",
        "host/transport/descriptor.hpp", "tools/diastole/commands.hpp"}},
      {"tools/diastole/runs",
       {"protocol", "estimator/explain/verdict", "estimator/io", "estimator/report",
        "tools/diastole/commands.hpp"}},
      {"tools/diastole/compare",
       {"protocol", "estimator/inference", "estimator/io", "estimator/report",
        "tools/diastole/commands.hpp"}},
      {"tools/diastole/catheter", {"protocol", "estimator", "tools/diastole/commands.hpp"}},
      {"tools/benchmarks/verification", {"protocol/contract", "estimator"}},
      {"tools", {"protocol", "firmware", "host", "estimator"}},
      {"tests", {"protocol", "firmware", "host", "estimator", "tools"}},
  };
  return list;
}

std::vector<Include> violations(const fs::path& root) {
  std::vector<Include> found = all_includes(root);
  // A path that does not start at the root would slip past the rules: it counts as a violation too.
  std::erase_if(found, [](const Include& each) {
    return is_project_path(each.included) && allowed(each.file, each.included);
  });
  return found;
}

std::vector<Include> circles(const fs::path& root) {
  const std::vector<Include> includes = all_includes(root);
  Graph graph;
  for (const Include& each : includes)
    if (folder_of(each.file) != folder_of(each.included))
      graph[folder_of(each.file)].insert(folder_of(each.included));
  std::map<std::string, std::set<std::string>> reached;
  for (const auto& [folder, _] : graph)
    reach(graph, folder, reached[folder]);
  std::vector<Include> found;
  for (const Include& each : includes) {
    const std::string from = folder_of(each.file), to = folder_of(each.included);
    if (from != to && reached[to].contains(from)) found.push_back(each);
  }
  return found;
}

}  // namespace diastole::layering
