#pragma once
// One run of program sim_board: the board behind a pseudo-terminal, a pin trace, injected inputs, a flash
// that is kept in a file, power cuts.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tools/sim_board/report.hpp"

namespace diastole {

/// When a button is pressed or a switch is closed from outside, and when it is let go.
struct Span {
  double from_s = 0;
  std::optional<double> to_s;
};
/// "2.5" or "2.5..4"; throws InputError, naming `option`, for anything else.
Span parse_span(const std::string& text, const std::string& option);

struct LimitAt {
  Span span;
  bool far = false;
};
/// "2.5:home", "2.5..4:far"; throws InputError for anything else.
LimitAt parse_limit(const std::string& text);

struct SessionOptions {
  std::vector<std::string> images;
  std::string link, pins, flash;
  bool real_time = false;
  std::optional<double> seconds;
  std::vector<std::string> estop_at, limit_at;
  std::optional<uint64_t> power_cut;
  uint32_t crystal_Hz = 8'000'000;
};

/// Runs until the time is over or `stop` (a descriptor) becomes readable. Prints one JSON line with the
/// serial port's path when a link was asked for. Throws InputError and HardwareError.
BoardReport run_session(const SessionOptions& options, int stop);

}  // namespace diastole
