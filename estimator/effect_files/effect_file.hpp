#pragma once
// A hypothesis as a text file, NAME.effect.toml (docs/effects-as-files.md): what the file says, its formulas read into a
// graph. What they do to a rig is decided by who asks: estimator/effects/file_effect.hpp for the estimator's model,
// tools/sim_rig for the simulated plant.

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/effect_files/quantities.hpp"
#include "estimator/expressions/graph.hpp"
#include "estimator/expressions/unit.hpp"

namespace diastole::effect_files {

struct FileParameter {
  std::string name;
  std::string unit;
  std::string meaning;
  expressions::Unit measured_in;
  double neutral = 0.0;
  std::optional<In> neutral_constant = {};  ///< neutral is what the rig has: neutral = "c_hose"
  double lower = 0.0;
  double upper = 0.0;
  double typical = 0.0;
  std::string scale = "linear";  ///< "logarithmic", "inverse-square"
};

/// A quantity of its own with dx/dt = rate, `initial` when a run begins.
struct FileState {
  std::string name;
  expressions::NodeId initial = 0;
  expressions::NodeId rate = 0;
  std::string place = {};  ///< of the rate's formula: "line 12, column 8, key equations.p"
};

struct FileLaw {
  Out sets;
  expressions::NodeId node = 0;
  std::string place = {};
};
struct FileConstant {
  In sets;
  expressions::NodeId node = 0;
  std::string place = {};
};

struct EffectFile {
  std::string file;
  std::string id, title, port;
  std::string change_points = "none";  ///< "one", "several"
  bool keeps_modulus = true;
  std::string changes = {};                   ///< part of the rig: "hose", "drive", "catheter"
  std::vector<std::string> learnt_from = {};  ///< run_ids of the recordings that it was learnt from
  std::string equations;                      ///< as they stand in the file
  std::string source, looks_like, reveals;
  std::vector<std::string> looks_alike, shows_with;

  std::vector<FileParameter> parameters;
  std::vector<FileState> states;
  std::vector<FileLaw> laws;
  std::vector<FileConstant> constants;
  expressions::Graph graph;

  [[nodiscard]] size_t input_of_parameter(size_t i) const { return quantity_count + i; }
  [[nodiscard]] size_t input_of_state(size_t i) const { return quantity_count + parameters.size() + i; }
  [[nodiscard]] size_t inputs() const { return quantity_count + parameters.size() + states.size(); }
};

/// Makes something of a formula that stands at `place`: slopes, a program. Throws InputError if that is no finite number or too
/// long.
void make_of_formula(const std::string& file, const std::string& place, const std::function<void()>& make);

/// Throws InputError with file, line, column, what is wrong and what to change.
EffectFile read_effect_file(const std::filesystem::path& path);
EffectFile read_effect_text(std::string_view text, std::string name);

}  // namespace diastole::effect_files
