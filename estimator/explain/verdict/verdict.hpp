#pragma once
// A verdict in words.

#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

std::vector<std::string> ids_of(const std::vector<FoundEffect>& effects);
/// "hose-compliance + backlash"; `none` where there is no id.
std::string words_of(const std::vector<std::string>& ids, const char* none);

/// Whether the sets that are left open hold an effect and nothing at all.
bool may_be_nothing(const Explanation& found);

/// "at the port drive, V_piston by V_command, or as well at the port specimen, p by V": its rivals, too.
std::string place_of(const LearnedTerm& term);

/// A few sentences for people; with one for each search that did not settle.
std::string summary_of(const Explanation& found);

}  // namespace diastole::explain
