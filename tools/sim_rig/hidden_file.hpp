#pragma once
// --hide FILE: an effect of a file (docs/effects-as-files.md) in the simulated rig, as far as the plant has its port: the
// constants that it knows, and laws that depend on pressure, volume and time alone. Formulas are evaluated by
// estimator/expressions; where they enter is the plant's own.

#include <string>

#include "tools/sim_rig/hidden_effects.hpp"

namespace diastole::sim_rig {

/// Whether it is a file's name, not an effect's id.
bool is_effect_file(const std::string& id);

struct HiddenFile {
  std::string id;
  std::string port;
};
/// Puts it into the rig: the first parameter between half and twice its typical distance from neutral, as drawn, the others
/// typical. Throws InputError for a file that is none, or that says what the plant cannot do.
HiddenFile hide_file(const std::string& file, Draw& draw);

}  // namespace diastole::sim_rig
