#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host/config/experiment.hpp"
#include "host/config/rig_config.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/diastole/replay/replay_plan.hpp"

namespace diastole::replay {
namespace {

using runfile::RecordedRun;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr const char* experiment = R"(format = "diastole-experiment"
version = 1
[[segment]]
waveform = "parabolic"
stroke_mL = 8.0
period_s = 1.0
cycles = 2
)";

/// Two cycles of one second after a second of rest, three samples a second.
RecordedRun recorded() {
  RecordedRun run;
  run.file = "old.run.h5";
  run.protocol_toml = experiment;
  run.segments = {{1.0, "parabolic", 8.0, 1.0, 0.0, 2}};
  run.trigger_s = {1.0, 2.0};
  for (int i = 0; i < 10; ++i) {
    run.pressure.time_s.push_back(i / 3.0);
    run.pressure.channels["cavity_kPa"].push_back(0.1 * i);
    run.pressure.channels["cavity_filtered_kPa"].push_back(0.1 * i);
    run.pressure.channels["pump_kPa"].push_back(i);
    run.pump.time_s.push_back(i / 3.0);
    run.pump.commanded_mL.push_back(0);
  }
  run.rig = {{"bore_mm", 50.0},          {"screw_rev_per_cm", 5.0},     {"steps_per_rev", int64_t{400}},
             {"microsteps", int64_t{4}}, {"hose_length_m", 3.0},        {"hose_bore_mm", 10.0},
             {"pump_kPa_per_V", 10.0},   {"fluid_density_kg_m3", 998.0}};
  return run;
}

ReplayPlan plan_replay(const RecordedRun& run, const PlanOptions& options = {}) {
  return replay::plan_replay({run, runfile::rows_of(run)}, options);
}

RigConfig rig_of(const ReplayPlan& plan) {
  return read_rig(TableReader::from_text(plan.rig_toml, "replay.rig.toml"));
}

TEST(ReplayPlan, TakesExperimentAndRigFromTheFile) {
  const ReplayPlan plan = plan_replay(recorded());
  EXPECT_EQ(plan.experiment_toml, experiment);
  const RigConfig rig = rig_of(plan);
  EXPECT_EQ(rig.controller.microsteps, 4);
  EXPECT_EQ(std::get<double>(rig.attributes.at("bore_mm")), 50.0);
  ASSERT_EQ(rig.daq.channels.size(), 2U) << "what was filtered is not measured";
  EXPECT_EQ(rig.daq.channels[1].name, "pump");
  EXPECT_EQ(rig.daq.channels[1].kPa_per_V, 10);
  EXPECT_TRUE(plan.settings.empty());
  EXPECT_TRUE(plan.faults.empty());
  EXPECT_THAT(plan.remarks, ElementsAre(HasSubstr("limits")));
}

TEST(ReplayPlan, TakesSettingsLimitsClocksAndTheStartingPlace) {
  RecordedRun run = recorded();
  run.rig["settings_record"] = int64_t{3};
  run.rig["backlash_um"] = 20.0;
  run.rig["calibration_ppm"] = int64_t{500};
  run.rig["lease_ms"] = int64_t{300};
  for (const char* limit : {"limit_travel_mL", "limit_flow_mL_s", "limit_acceleration_mL_s2",
                            "limit_step_rate_Hz", "limit_pressure_kPa", "limit_cavity_kPa"})
    run.rig[limit] = 77.0;
  run.clock = {{"host_drift_ppm", 12.0}, {"daq_drift_ppm", -30.0}};
  run.pump.commanded_mL.front() = 5.0;
  const ReplayPlan plan = plan_replay(run);
  EXPECT_EQ(plan.settings.at("backlash_um"), 20);
  EXPECT_EQ(plan.settings.at("calibration_ppm"), 500);
  EXPECT_EQ(plan.settings.at("microsteps"), 4);
  EXPECT_EQ(plan.host_drift_ppm, 12);
  EXPECT_THAT(plan.rig_toml, HasSubstr("daq_clock_error_ppm = -30"));
  EXPECT_EQ(plan.start_mL, 5);
  const RigConfig rig = rig_of(plan);
  EXPECT_EQ(rig.controller.lease_ms, 300);
  EXPECT_EQ(rig.controller.limits.acceleration_mL_s2, 77);
  EXPECT_EQ(rig.controller.limits.cavity_kPa, 77);
  EXPECT_TRUE(plan.remarks.empty()) << plan.remarks.front();
}

TEST(ReplayPlan, GivesPointsFilesNamesOfTheirOwn) {
  RecordedRun run = recorded();
  run.protocol_toml = R"(format = "diastole-experiment"
version = 1
[[segment]]
waveform = "uploaded"
points = '../elsewhere/heart.csv'
)";
  EXPECT_THROW(plan_replay(run), InputError) << "its points are not there";
  run.waveforms[0].points = "phase,fraction\n0,0\n";
  const ReplayPlan plan = plan_replay(run);
  EXPECT_EQ(plan.points.at("waveform-0.csv"), "phase,fraction\n0,0\n");
  EXPECT_THAT(plan.experiment_toml, HasSubstr("points = \"waveform-0.csv\""));
}

TEST(ReplayPlan, MakesAnExperimentOfSegmentsThatAnotherProgramTold) {
  RecordedRun run = recorded();
  run.protocol_toml = "name = \"baseline\"\n";
  run.segments = {
      {0.0, "hold", 0.0, 1.0, 0.0, 1}, {1.0, "parabolic", 8.0, 1.0, 0.0, 2}, {3.0, "hold", 0, 1, 0, 1}};
  const ReplayPlan plan = plan_replay(run);
  const Experiment made = parse_experiment(plan.experiment_toml, "made");
  EXPECT_NEAR(made.sample_rate_Hz, 3, 1e-6);
  EXPECT_EQ(made.rest_s, 1);
  ASSERT_EQ(made.segments.size(), 1U);
  EXPECT_EQ(made.segments[0].cycles, 2);
  EXPECT_THAT(plan.remarks, testing::Contains(HasSubstr("segment 2 (hold, 1 s)")));
}

TEST(ReplayPlan, SaysWhatAFileLacks) {
  const auto refusal = [](const RecordedRun& run) -> std::string {
    try {
      plan_replay(run);
    } catch (const InputError& error) {
      return error.what();
    }
    return "taken";
  };
  RecordedRun run = recorded();
  run.protocol_toml = "";
  run.segments.clear();
  EXPECT_THAT(refusal(run), testing::AllOf(HasSubstr("old.run.h5"), HasSubstr("/protocol/segments")));
  run.segments = {{1.0, "uploaded", 8.0, 1.0, 0.0, 2}};
  EXPECT_THAT(refusal(run), HasSubstr("/protocol/waveforms/0"));
  run.segments = {{0.0, "hold", 0.0, 0.5, 0.0, 1}};
  EXPECT_THAT(refusal(run), HasSubstr("none of its segments moves"));
}

TEST(ReplayPlan, BringsAboutWhatHappened) {
  RecordedRun run = recorded();
  run.events = {{1.25, "warning", "stop", "controlled stop was asked for"},
                {1.5, "error", "estop", "The emergency stop was pressed"}};
  ReplayPlan plan = plan_replay(run);
  EXPECT_THAT(plan.faults, ElementsAre("estop@run+1.499999000s"));
  ASSERT_EQ(plan.orders.size(), 1U);
  EXPECT_EQ(plan.orders[0].kind, Order::Kind::stop_now);
  EXPECT_EQ(plan.orders[0].time_s, 1.25);
  EXPECT_EQ(end_of(run), "faulted: estop");

  run.events = {{1.25, "info", "stop", "stop at the end of this cycle was asked for"},
                {2.5, "error", "link_lost", "the controller has fallen silent; the pump stops by itself"},
                {2.5, "error", "incomplete", "the recording broke off here"}};
  plan = plan_replay(run);
  EXPECT_THAT(plan.faults, ElementsAre("serial-silence@run+1.500000000s"));
  EXPECT_EQ(plan.orders[0].kind, Order::Kind::stop_at_cycle_end);
  EXPECT_EQ(end_of(run), "link_lost");

  run.events = {{2.5, "error", "link_lost", "the controller was reset; the pump stops by itself"}};
  plan = plan_replay(run, {.onset_shift_s = 0.001});
  EXPECT_THAT(plan.faults, ElementsAre("power-cut@run+2.491000000s:off@run+2.496000000s")) << "just before";
  run.pump.time_s.back() = 2.4;
  EXPECT_THAT(plan_replay(run).faults, ElementsAre("power-cut@run+2.402000000s:off@run+2.495000000s"));
  EXPECT_TRUE(late_sign(run));

  run.events = {{2.5, "error", "step_underrun", ""}, {2.6, "error", "journal_failed", ""}};
  plan = plan_replay(run);
  EXPECT_TRUE(plan.faults.empty());
  EXPECT_THAT(plan.remarks, testing::IsSupersetOf({HasSubstr("step_underrun"), HasSubstr("journal_failed")}));
}

TEST(ReplayPlan, TheOperatorIsReadyBetweenTheTriggersWhereHeWas) {
  RecordedRun run = recorded();
  run.trigger_s = {1, 2, 3, 4, 5, 6};
  run.slices = {{"tagged", 0, 1, 2, 2, 1}, {"tagged", 1, 5, 1, 1, 1}};
  const ReplayPlan plan = plan_replay(run);
  ASSERT_EQ(plan.orders.size(), 2U);
  EXPECT_EQ(plan.orders[0].kind, Order::Kind::go_on);
  EXPECT_LT(plan.orders[0].time_s, 1);
  EXPECT_GT(plan.orders[1].time_s, 4);
  EXPECT_LT(plan.orders[1].time_s, 5);
  EXPECT_EQ(plan.orders[1].slice, 1U);
}

}  // namespace
}  // namespace diastole::replay
