#pragma once
// A finding as it stands in the JSON of fits and reconstructions.

#include "estimator/io/finding.hpp"
#include "estimator/io/member_json.hpp"

namespace diastole {

template <>
struct JsonWords<Severity> {
  static constexpr const char* kind = "severity";
  static constexpr std::array all{Severity::note, Severity::warning, Severity::error};
  static constexpr std::string_view (*word_of)(Severity) = describe;
};

DIASTOLE_MEMBERS(Finding, severity, id, what, where, number, unit, remedy)

}  // namespace diastole
