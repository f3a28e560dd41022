#pragma once
// A benchmark's figures beside their targets: one that misses its own is marked MISSED where it is printed, and any of them makes the
// exit code 1.

#include <cstddef>
#include <limits>
#include <string>

#include "protocol/contract/exit_code.hpp"

namespace diastole {

class FigureTargets {
 public:
  /// "0.031", or "0.131 MISSED" outside of [least, most]; what is not a number misses every target.
  std::string within(double value, double least, double most, const char* form = "{:.3f}");
  std::string at_most(double value, double most, const char* form = "{:.3f}") {
    return within(value, -std::numeric_limits<double>::infinity(), most, form);
  }
  std::string at_least(double value, double least, const char* form = "{:.3f}") {
    return within(value, least, std::numeric_limits<double>::infinity(), form);
  }
  /// " MISSED" to go behind what was found, or nothing.
  std::string mark(bool is_met);

  /// Prints how many targets were met, as the last line; the program's exit code.
  [[nodiscard]] ExitCode conclude() const;

 private:
  size_t figures_ = 0, missed_ = 0;
};

}  // namespace diastole
