#pragma once
// What each method of the rig (host/rpc/methods.hpp) takes: parameters that it accepts.

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace diastole {

inline const std::map<std::string, nlohmann::json>& usual_requests() {
  using nlohmann::json;
  constexpr const char* experiment = R"(format = "diastole-experiment"
version = 1
[[segment]]
waveform = "uploaded"
points = "a.csv"
stroke_mL = 20
period_s = 0.8
cycles = 4
)";
  static const std::map<std::string, json> all{
      {"rig.status", json::object()},
      {"rig.home", json::object()},
      {"rig.zero", {{"channels", json::array({"cavity"})}, {"seconds", 5}, {"operator", "Jo"}}},
      {"rig.calibrate",
       {{"channels", json::array({"cavity"})}, {"kPa", 10}, {"seconds", 5}, {"operator", "Jo"}}},
      {"rig.clear_fault", json::object()},
      {"rig.jog", {{"mL", 5.0}, {"rate_mL_s", 1.0}}},
      {"rig.settings", json::object()},
      {"rig.write_settings", {{"set", {{"backlash_um", 40}, {"board_name", "MR1"}}}, {"defaults", true}}},
      {"rig.self_test", {{"seconds", 10}}},
      {"rig.black_box", json::object()},
      {"run.start",
       {{"experiment", experiment},
        {"file", "e.toml"},
        {"points", {{"a.csv", "phase,fraction\n0,0\n.5,1\n1,0\n"}}},
        {"prompts_answered", true},
        {"resume", false},
        {"session",
         {{"specimen", "gel"},
          {"operator", "Jo"},
          {"room_temperature_C", 21.5},
          {"notes", json::array({"a note"})}}}}},
      {"run.progress", {{"first_remark", 0}}},
      {"run.trace", {{"run_id", "run-1"}, {"first_row", 0}, {"first_trigger", 0}}},
      {"run.continue", {{"slice", 1}}},
      {"run.stop", {{"how", "cycle_end"}}},
  };
  return all;
}

}  // namespace diastole
