#pragma once
// One run of program sim_board: the board behind a pseudo-terminal, a pin trace, injected inputs, a flash
// that is kept in a file, power cuts.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "tools/sim_board/image_file.hpp"
#include "tools/sim_board/sim_board.hpp"

namespace diastole {

/// What a run on the emulated board has shown, for a person and as JSON.
struct BoardReport {
  BoardStatistics board;
  std::vector<Image> images;
  uint64_t steps = 0, triggers = 0;
  double wall_s = 0;
};

nlohmann::json to_json(const BoardReport& report);
std::string to_text(const BoardReport& report);

struct SessionOptions {
  std::vector<std::string> images;
  std::string link, pins, flash;
  bool real_time = false;
  std::optional<double> seconds;
  std::vector<std::string> estop_at, limit_at;
  bool loop_back = false;  ///< the wires of a self-test are on
  std::optional<uint64_t> power_cut;
  uint32_t crystal_Hz = 8'000'000;
  board_model::FlashTiming flash_timing = board_model::FlashTiming::hits;
};

/// Runs until the time is over or `stop` (a descriptor) becomes readable. Prints one JSON line with the
/// serial port's path when a link was asked for. Throws InputError and HardwareError.
BoardReport run_session(const SessionOptions& options, int stop);

}  // namespace diastole
