#pragma once
// A verdict in words.

#include <string>

#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// A few sentences for people; with one for each search that did not settle.
std::string summary_of(const Explanation& found);

}  // namespace diastole::explain
