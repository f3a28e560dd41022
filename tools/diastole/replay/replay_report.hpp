#pragma once
// What a replay has found, as a table for people or as one JSON document.

#include <nlohmann/json.hpp>
#include <string>

#include "tools/diastole/replay/compare.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {

struct ReplayReport {
  std::string recorded;  ///< file
  std::string replayed;  ///< file; empty: not kept
  std::string firmware;  ///< "host build 0.1.0", "diastole-stm32f405.elf 0.1.0"
  ReplayPlan plan;
  Comparison comparison;
  double simulated_s = 0;
  double wall_s = 0;
};

std::string as_table(const ReplayReport& report);
nlohmann::json as_json(const ReplayReport& report);

}  // namespace diastole::replay
