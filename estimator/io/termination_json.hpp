#pragma once
// How a search ended, as a word of JSON documents.

#include <array>

#include "estimator/inference/termination.hpp"
#include "estimator/io/member_json.hpp"

namespace diastole {

template <>
struct JsonWords<inference::Termination> {
  using enum inference::Termination;
  static constexpr const char* kind = "termination";
  static constexpr std::array all{converged, on_bound, stalled, iteration_limit, interrupted, no_solution};
  static constexpr std::array words{"converged",       "on-bound",    "stalled",
                                    "iteration-limit", "interrupted", "no-solution"};
  static const char* word_of(inference::Termination termination) {
    return words[static_cast<size_t>(termination)];
  }
};

}  // namespace diastole
