#pragma once
// Findings for people.

#include <cstdio>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

/// Two lines a finding: what and where, and the remedy.
void print_findings(const std::vector<Finding>& findings, std::FILE* stream);

}  // namespace diastole
