#include "estimator/io/finding_json.hpp"

#include <cmath>
#include <limits>
#include <stdexcept>

namespace diastole {
namespace {

Severity to_severity(const std::string& word) {
  for (const Severity severity : {Severity::note, Severity::warning, Severity::error}) {
    if (describe(severity) == word) return severity;
  }
  throw std::invalid_argument(word + " is no severity");
}

}  // namespace

nlohmann::ordered_json from_finding(const Finding& finding) {
  nlohmann::ordered_json number;
  if (std::isfinite(finding.number)) number = finding.number;
  return {{"severity", describe(finding.severity)},
          {"id", finding.id},
          {"what", finding.what},
          {"where", finding.where},
          {"number", std::move(number)},
          {"unit", finding.unit},
          {"remedy", finding.remedy}};
}

Finding to_finding(const nlohmann::ordered_json& json) {
  const nlohmann::ordered_json& number = json.at("number");
  return {to_severity(json.at("severity")),
          json.at("id"),
          json.at("what"),
          json.at("where"),
          number.is_null() ? std::numeric_limits<double>::quiet_NaN() : number.get<double>(),
          json.at("unit"),
          json.at("remedy")};
}

}  // namespace diastole
