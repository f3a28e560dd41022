#pragma once
// What was hidden in recordings: the labels.json beside independent data, and the sealed files that the simulated
// rig writes. Only a scorer reads them.
//
// Sealed file NAME.sealed.json, beside or apart from its recordings:
//
//   {"format": "diastole-sealed", "format_version": 1, "seed": 7, "kind": "single",
//    "truth": [{"id": "air-bubble-pump", "port": "drive", "parameters": {"volume_mL": 4.2}}]}
//
// Labels of rigs with imperfections ({"cases": ..., "rigs": ...}) also state how large the effect is beside them and which of
// them an explanation may name.

#include <filesystem>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

enum class TruthKind { none, single, pair, outside, inseparable };
std::string_view name_of(TruthKind kind);

/// Beside what the rig's model gets wrong by itself: five times that and more, twice, less.
enum class EffectSize { large, medium, small };

struct HiddenEffect {
  std::string id;    ///< of no library: begins with "outside:"
  std::string port;  ///< empty if the file does not say
  std::map<std::string, double> parameters;
};

struct Truth {
  std::string name;  ///< of the case: "case-054", "field-003"
  TruthKind kind = TruthKind::none;
  std::vector<HiddenEffect> hidden;
  std::vector<std::vector<std::string>>
      alternatives;  ///< sets that fit these data as well; an empty set: no effect
  std::vector<std::vector<std::string>>
      alternatives_without_reference;       ///< and those if the rig's error is not known
  std::vector<HiddenEffect> imperfections;  ///< of the rig, large enough to be named
  EffectSize size =
      EffectSize::large;  ///< of a pair the smaller one's; if the file does not say: small below d = 8
  double size_sigma = std::numeric_limits<double>::quiet_NaN();  ///< d; NaN if the file does not say
  std::vector<Verdict> acceptable;                               ///< if the file restricts the verdicts

  [[nodiscard]] std::vector<std::string> ids() const;  ///< sorted
};

/// `place`: a labels.json, a folder that has one, a sealed file or a folder of them. Throws InputError.
std::vector<Truth> read_truths(const std::filesystem::path& place);

}  // namespace diastole::explain
