// `run --shape` and `simulate --shape` with sessions that need no daemon: the simulated rig's plant, or none at all.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <tuple>

#include "host/cli/session_series.hpp"
#include "host/config/even_waveform.hpp"
#include "host/config/experiment.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/host/bench/run_in_memory.hpp"
#include "tests/tools/diastole/shape_loop.hpp"
#include "tools/diastole/commands.hpp"

namespace diastole::shaping {
namespace {

namespace fs = std::filesystem;

class ShapeSeriesTest : public testing::Test {
 protected:
  [[nodiscard]] fs::path output() const { return folder_.path() / "followed.run.h5"; }
  [[nodiscard]] fs::path at(const std::string& name) const { return folder_.path() / name; }

  ExitCode carry_out(size_t iterations, bool force, const SessionSeries::Acquire& acquire,
                     double tolerance_percent = 5, const std::string& target = {}) {
    const fs::path example = fs::path(DIASTOLE_SOURCE_DIR) / "examples/shape";
    CLI::App command;
    const std::shared_ptr<SessionSeries> series = make_shape_series();
    series->add_options(command);
    command.parse(fmt::format("--shape {} --study {} --cycles 9 --iterations {} --tolerance-percent {}",
                              target.empty() ? (example / "ventricle.csv").string() : target,
                              (example / "gel.study.toml").string(), iterations, tolerance_percent));
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    std::optional<InputError> refused;
    ExitCode code = ExitCode::bad_input;
    try {
      const auto connect = [&] {
        ++connections_;
        return acquire;
      };
      code = series->carry_out(output().string(), force, connect, {});
    } catch (const InputError& error) {
      refused = error;
    }
    printed_ = testing::internal::GetCapturedStdout();
    remarks_ = testing::internal::GetCapturedStderr();
    if (refused) throw InputError(*refused);
    return code;
  }
  /// A session of the experiment on the plant, into a run file.
  SessionResult played(const std::string& experiment_file, const std::string& run_file) {
    const Experiment experiment = read_experiment(experiment_file);
    const ExperimentSegment& segment = experiment.segments.at(0);
    std::vector<double> volume_mL = on_even_phases(experiment.waveforms.at(0).points, 2048).fractions();
    volume_mL.pop_back();
    for (double& volume : volume_mL)
      volume = segment.offset_mL + segment.stroke_mL * volume;
    runfile::RecordedRun run = plant_->play(periodic_curve(volume_mL, segment.period_s, 64)).run;
    for (size_t i = 0; i < run.pressure.time_s.size(); ++i)
      if (run.pressure.time_s[i] > plan_.rest_s) run.pressure.channels["cavity_kPa"][i] += zero_drift_kPa_;
    run.run_id = fs::path(run_file).stem().string();
    run.started_utc = "2024-01-01T00:00:00Z";
    run.producer = "test";
    run.protocol_toml = experiment.text;
    run.waveforms.at(0).points = experiment.waveforms.at(0).points.text;
    write_run(run_file, run);
    return clean(run_file);
  }
  static SessionResult clean(const std::string& run_file) {
    return {.run = run_file, .end = "completed", .regular = true, .cycles = 9, .triggers = 9};
  }

  static constexpr CyclePlan plan_{.rest_s = 1.0, .cycles = 9, .settling = 3};
  std::string printed_, remarks_;
  int connections_ = 0;
  std::unique_ptr<PlantForShape> plant_ = std::make_unique<PlantForShape>(with_effects({}), plan_);
  double zero_drift_kPa_ = 0.0;  ///< of the transducer, while the pump moves

 private:
  test::ScratchFolder folder_;
};

TEST_F(ShapeSeriesTest, TheSecondSessionPlaysWhatTheFirstHasTaught) {
  std::vector<std::string> experiments;
  const ExitCode code = carry_out(2, false, [&](const std::string& experiment, const std::string& run) {
    experiments.push_back(experiment);
    return played(experiment, run);
  });
  EXPECT_EQ(code, ExitCode::done) << remarks_;
  ASSERT_EQ(experiments.size(), 2U);
  EXPECT_EQ(experiments[1], at("followed.2.experiment.toml").string());
  EXPECT_NE(read_experiment(experiments[0]).segments[0].stroke_mL,
            read_experiment(experiments[1]).segments[0].stroke_mL);
  EXPECT_THAT(printed_, testing::HasSubstr("followed.2.run.h5: NRMSE"));
}

TEST_F(ShapeSeriesTest, ABestRunThatMissesTheCurveIsANegativeAnswer) {
  const SessionSeries::Acquire acquire = [&](const std::string& experiment, const std::string& run) {
    return played(experiment, run);
  };
  EXPECT_EQ(carry_out(1, false, acquire, 50), ExitCode::done) << remarks_;
  EXPECT_EQ(carry_out(1, true, acquire), ExitCode::negative)
      << "five hidden effects, and nothing learned yet";
  EXPECT_THAT(remarks_, testing::HasSubstr("With the best drive that was run the specimen misses the curve"));
  EXPECT_THAT(remarks_, testing::HasSubstr("5 % are allowed"));
}

/// Three times as fast as the example.
TEST_F(ShapeSeriesTest, NothingIsRunWhileTheModelItselfMissesTheCurve) {
  std::ofstream(at("fast.csv")) << "time_s,volume_mL\n0,0\n0.05,1\n0.2,18\n0.3,24\n0.35,12\n0.4,0\n";
  const SessionSeries::Acquire none = [](const std::string&, const std::string& run) { return clean(run); };
  EXPECT_EQ(carry_out(2, false, none, 5, at("fast.csv").string()), ExitCode::negative);
  EXPECT_EQ(connections_, 0);
  EXPECT_THAT(remarks_,
              testing::HasSubstr("With the nearest drive by the model the specimen misses the curve by "));
  EXPECT_THAT(remarks_, testing::HasSubstr("Nothing was run."));
  EXPECT_FALSE(fs::exists(at("followed.1.csv")));
}

TEST_F(ShapeSeriesTest, ALevelThatIsOffIsANegativeAnswerAndSaysWhatItPointsTo) {
  for (const auto& [drift_kPa, side, cause] :
       {std::tuple{0.4, "mL too high", "the transducer's zero has drifted"},
        std::tuple{-0.4, "mL too low", "What leaks from cycle to cycle"}}) {
    SCOPED_TRACE(side);
    plant_ = std::make_unique<PlantForShape>(sim_rig::PlantConfig{}, plan_);
    zero_drift_kPa_ = drift_kPa;
    EXPECT_EQ(carry_out(1, true,
                        [&](const std::string& experiment, const std::string& run) {
                          return played(experiment, run);
                        }),
              ExitCode::negative);
    EXPECT_THAT(remarks_, testing::HasSubstr(side));
    EXPECT_THAT(remarks_, testing::HasSubstr(cause));
    EXPECT_THAT(remarks_, testing::Not(testing::HasSubstr("misses the curve"))) << "its shape is right";
  }
}

TEST_F(ShapeSeriesTest, AFaultySessionStopsTheSeriesAndKeepsItsExitCode) {
  SessionResult errors = clean("x"), gaps = errors, triggers = errors, fault = errors, stopped = errors;
  errors.errors = 1;
  gaps.gaps = 20;
  triggers.triggers = 7;
  fault.regular = false;
  fault.end = "the controller does not answer";
  stopped.end = "stopped_at_cycle_end";
  for (const auto& [result, code, words] :
       {std::tuple{errors, ExitCode::negative, "1 errors noted"},
        std::tuple{gaps, ExitCode::negative, "20 samples missing"},
        std::tuple{triggers, ExitCode::negative, "7 triggers in 9 cycles"},
        std::tuple{fault, ExitCode::hardware_fault, "the controller does not answer"},
        std::tuple{stopped, ExitCode::done, "stopped_at_cycle_end"}}) {
    SCOPED_TRACE(words);
    size_t sessions = 0;
    EXPECT_EQ(carry_out(3, true,
                        [&, given = result](const std::string&, const std::string&) {
                          ++sessions;
                          return given;
                        }),
              code);
    EXPECT_EQ(sessions, 1U);
    EXPECT_THAT(remarks_, testing::HasSubstr(words));
  }
}

// `simulate EXPERIMENT --rig soft.rig.toml`, where --config was meant, ran the built-in rig.
TEST_F(ShapeSeriesTest, ItsOptionsAreRefusedWithoutACurveToFollow) {
  for (const char* option :
       {"--rig soft.rig.toml", "--study gel.study.toml", "--cycles 9", "--iterations 2", "--page p.html"}) {
    const auto series = make_shape_series();
    CLI::App command;
    series->add_options(command);
    EXPECT_THROW(command.parse(option), CLI::RequiresError) << option;
  }
}

TEST_F(ShapeSeriesTest, ForceLeavesNothingOfALongerSeries) {
  const auto write = [&](const std::string& name) { std::ofstream(at(name)) << "earlier\n"; };
  for (const char* name : {"followed.1.run.h5", "followed.5.run.h5", "followed.5.csv", "followed.x.csv"})
    write(name);
  const SessionSeries::Acquire none = [](const std::string&, const std::string& run) {
    SessionResult result = clean(run);
    result.end = "stopped_now";
    return result;
  };
  EXPECT_THROW((void)carry_out(2, false, none), InputError);
  EXPECT_TRUE(fs::exists(at("followed.5.run.h5")));
  EXPECT_EQ(carry_out(2, true, none), ExitCode::done);
  EXPECT_FALSE(fs::exists(at("followed.5.run.h5")));
  EXPECT_FALSE(fs::exists(at("followed.5.csv")));
  EXPECT_TRUE(fs::exists(at("followed.1.csv")));
  EXPECT_TRUE(fs::exists(at("followed.x.csv"))) << "it belongs to no series";
}

}  // namespace
}  // namespace diastole::shaping
