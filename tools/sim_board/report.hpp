#pragma once
// What a run on the emulated board has shown, for a person and as JSON.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "tools/sim_board/image_file.hpp"
#include "tools/sim_board/sim_board.hpp"

namespace diastole {

struct BoardReport {
  BoardStatistics board;
  std::vector<Image> images;
  uint64_t steps = 0, triggers = 0;
  double wall_s = 0;
};

nlohmann::json to_json(const BoardReport& report);
std::string to_text(const BoardReport& report);

}  // namespace diastole
