#pragma once
// The fault table: for every fault that host and controller must survive, how often it was tried, how often
// everything that must hold held, and what it cost. Printed when the suite ends.

#include <functional>
#include <random>
#include <string>

namespace diastole::faults {

struct FaultRow {
  std::string fault;
  std::string tried_how;
  int tried = 0;
  int survived = 0;
  std::string lost;  ///< in words: at most 112 ms, 0 commands, ...
};

void add_to_table(const FaultRow& row);

/// Counts of the quick sample, or of the full suite if DIASTOLE_FAULTS=full.
int trials(int quick, int full);

/// Runs `trial(k, random)` that often; each trial has its own seed and tells whether what must hold held.
int survivors(int tried, const std::function<bool(int, std::mt19937&)>& trial);

/// Uniform in [from, to).
double between(std::mt19937& random, double from, double to);

}  // namespace diastole::faults
