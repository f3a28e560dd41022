#pragma once
// What was found as a self-contained page: a table with a thumbnail of each run's pressure.

#include <string>

#include "tools/diastole/runs/catalogue.hpp"

namespace diastole::catalogue {

/// `folder` and `asked`: what was searched, and for what, in words.
std::string runs_page(const std::string& folder, const std::string& asked, const Found& found);

/// "8.57 ± 0.08 kPa"; empty if it is not known.
std::string stiffness_words(const Entry& entry);
/// "sound", "not sound", or empty for what is no run.
std::string sound_words(const Entry& entry);

}  // namespace diastole::catalogue
