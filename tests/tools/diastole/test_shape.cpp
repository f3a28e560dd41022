// A drive is learned on the simulated rig's plant, which shares no code with the model that learns.

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "protocol/contract/input_error.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/tools/diastole/shape_loop.hpp"
#include "tools/diastole/shape/drive_file.hpp"
#include "tools/diastole/shape/pump.hpp"
#include "tools/diastole/shape/shaper.hpp"
#include "tools/diastole/shape/wanted_curve.hpp"

namespace diastole::shaping {
namespace {

TEST(Shape, TheModelAloneFollowsOnARigThatIsAsDescribedButForTheMotorsLag) {
  constexpr double lag_s = 0.0046;  // of motor and coupling, and the plant's step (docs/hidden-effects.md)
  PlantForShape rig({}, plan);
  PeriodicCurve wanted = ventricle();
  const DriveModel model = gel_model();
  const PlantRun run = rig.play(model.inverse(wanted, wanted.with(harmonics_needed(wanted, 1e-3, 24))));
  EXPECT_LE(true_nrmse(run, wanted), 0.02);
  for (Eigen::Index k = 1; k <= wanted.harmonics(); ++k)
    wanted.c[k] *= std::polar(1.0, -2.0 * M_PI * wanted.frequency_Hz(k) * lag_s);
  EXPECT_LE(true_nrmse(run, wanted), 0.004);
}

TEST(Shape, PressureTeachesTheDriveWithFiveHiddenEffects) {
  PlantForShape rig(with_effects({}), plan);
  expect_followed(learned(rig, ventricle(), 3));
}

TEST(Shape, ALeakThatOpensInARunEndsLearning) {
  sim_rig::PlantConfig weak;
  weak.flaws.drive.gain = -0.06;
  PlantForShape rig(weak, plan);
  const Loop loop = learned(rig, ventricle(), 4, {}, 2);
  ASSERT_EQ(loop.runs.size(), 2U);
  EXPECT_EQ(loop.lesson.ending, Ending::changed);
  EXPECT_TRUE(loop.runs.back().changed_in_cycle);
  EXPECT_EQ(loop.lesson.best, 0U);
  EXPECT_LT(loop.lesson.drive_mL.range(), loop.runs.back().drive_mL.range() - 1.0)
      << "it pushes on as hard as when the leak opened";
}

double least_mL(const PeriodicCurve& drive) { return drive.at(drive.least_at_s()); }

TEST(Shape, ALevelThatFallsInEachRunIsFollowedByAQuarterOfTheRangeAtMost) {
  PlantForShape rig(with_effects({.leak_mL_s_kPa = 0.3}), plan);
  const Loop loop = learned(rig, ventricle(), 4);
  ASSERT_GE(loop.runs.size(), 2U);
  const PeriodicCurve& first = loop.runs.front().drive_mL;
  const double most_mL = least_mL(first) + 0.25 * first.range() + 0.01;
  for (const GatedRun& run : loop.runs)
    EXPECT_LE(least_mL(run.drive_mL), most_mL);
  EXPECT_GT(least_mL(loop.runs.back().drive_mL), most_mL - 0.1) << "nothing had to be held back";
  EXPECT_TRUE(loop.lesson.guarded);
  EXPECT_LT(loop.lesson.iterations.back().level_error_mL, -3.0) << "the level that is lost is not shown";
}

TEST(Shape, ALevelThatIsLostAltogetherEndsLearning) {
  const PeriodicCurve wanted = ventricle();
  PlantForShape rig({}, plan);
  const DriveModel model = gel_model();
  const PeriodicCurve first = model.inverse(wanted, wanted.with(harmonics_needed(wanted, 1e-3, 24)));
  std::vector<GatedRun> runs;
  for (int run = 0; run < 2; ++run)
    runs.push_back(gated_run(rig.play(first).run, model, period_s, 2 * first.harmonics()));
  runs.back().cavity_mL.curve.c[0] -= 1.2 * range_mL;  // as a transducer shows it whose zero has drifted
  const Lesson lesson = learn(model, wanted, first, runs, free_pump);
  EXPECT_EQ(lesson.ending, Ending::changed) << in_words(lesson.ending) << " " << lesson.reason;
  EXPECT_THAT(lesson.reason, testing::HasSubstr("zero drifts"));
}

/// As far as it is to be filled no cavity can be emptied.
TEST(Shape, ASpecimenThatIsToTakeMuchIsEmptiedNoFurther) {
  const rig::SpecimenResolution coarse{{4, 4, 1}, {4, 4, 1}};
  const rig::SpecimenFamily family(rig::gel_study(), coarse.reaching(200));
  const auto& points = family.plain().points();
  EXPECT_GE(points.back().volume_mL, 200);
  EXPECT_NEAR(points.front().volume_mL, -coarse.spacing_mL * static_cast<double>(coarse.points_emptied),
              1e-6);
}

TEST(Shape, ASpecimenIsFilledToAVolumeToAPressureOrToItsEnd) {
  const rig::SpecimenFamily gel = rig::gel_family();
  const rig::SpecimenReach to_volume = gel.reach(40, 1e3);
  EXPECT_EQ(to_volume.volume_mL, 48) << "the first of its volumes, every 16 mL";
  EXPECT_FALSE(to_volume.is_end);
  const rig::SpecimenReach to_pressure = gel.reach(1e4, 5);
  EXPECT_FALSE(to_pressure.is_end);
  EXPECT_GE(to_pressure.pressure_kPa, 5);
  EXPECT_LT(gel.reach(to_pressure.volume_mL - 16, 1e3).pressure_kPa, 5) << "it went on beyond";
  const rig::SpecimenReach to_end = gel.reach(1e4, 1e3);
  EXPECT_TRUE(to_end.is_end);
  EXPECT_GT(to_end.pressure_kPa, to_pressure.pressure_kPa);
  EXPECT_LT(to_end.volume_mL, 1e4);
}

TEST(Shape, WhatTheSpecimenIsExpectedToHoldGoesByTheModelAndByWhatTheBestRunHeldMore) {
  const PeriodicCurve wanted = ventricle();
  const DriveModel model = gel_model();
  const PeriodicCurve first = model.inverse(wanted, wanted.with(harmonics_needed(wanted, 1e-3, 24)));
  const double still_kPa = model.model().modulus_kPa * model.model().curve.at(range_mL).pressure_kPa;
  EXPECT_NEAR(learn(model, wanted, first, {}, free_pump).greatest_kPa, still_kPa, 0.02 * still_kPa);
  PlantForShape rig({}, plan);
  std::vector<GatedRun> runs{gated_run(rig.play(first).run, model, period_s, 2 * first.harmonics())};
  EXPECT_NEAR(runs.front().greatest_kPa, still_kPa, 0.05 * still_kPa);
  constexpr double stiff_kPa = 10.0;
  runs.front().greatest_kPa = stiff_kPa;
  EXPECT_NEAR(learn(model, wanted, first, runs, free_pump).greatest_kPa, stiff_kPa, 0.02 * stiff_kPa);
}

TEST(Shape, TheNearestDriveKeepsWithinItsBounds) {
  const PeriodicCurve wanted = ventricle().with(16);
  const DriveBounds bounds{.most_mL = 100.0, .flow_mL_s = 90.0, .acceleration_mL_s2 = [](double flow) {
                             return 1200.0 - 5.0 * flow;
                           }};
  ASSERT_FALSE(within(wanted, bounds));
  const Eigen::MatrixXd slope = Eigen::MatrixXd::Identity(33, 33);
  const PeriodicCurve nearest = nearest_within(wanted, slope, bounds);
  const auto largest = [&](const PeriodicCurve& curve, int order) {
    double most = 0.0;
    for (const double value : curve.at_even(512, order))
      most = std::max(most, std::abs(value));
    return most;
  };
  EXPECT_LE(largest(nearest, 1), 90.0 * 1.005);
  EXPECT_LE(largest(nearest, 2), bounds.acceleration_mL_s2(largest(nearest, 1)) * 1.01);
  // The best of its kind: no mixture with the wanted curve and no other size of it is nearer within the bounds.
  const double off = rms_between(nearest, wanted);
  for (double part = 0.02; part < 1.0; part += 0.02) {
    PeriodicCurve smaller = wanted;
    smaller.c.tail(16) *= part;
    EXPECT_FALSE(within(smaller, bounds) && rms_between(smaller, wanted) < off);
    PeriodicCurve mixed{wanted.period_s, part * wanted.c + (1.0 - part) * nearest.c};
    EXPECT_FALSE(largest(mixed, 1) < 89.0 &&
                 largest(mixed, 2) < bounds.acceleration_mL_s2(largest(mixed, 1)) * 0.98);
  }
}

RigConfig rig_with(const std::string& limits) {
  const std::filesystem::path file = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml";
  std::ifstream stream(file);
  std::string text((std::istreambuf_iterator<char>(stream)), {});
  const std::string daq = "[daq]";
  text.replace(text.find(daq), daq.size(), "[controller.limits]\n" + limits + "\n[daq]");
  return read_rig(TableReader::from_text(text, file.string()));
}

TEST(Pump, ADriveWithinTheLimitsStaysAndBeginsAtItsLeast) {
  const Pump pump(rig_with(""));
  PeriodicCurve drive = ventricle().with(16);
  drive.c[0] += 1.0;
  const PeriodicCurve nearest = pump.nearest(drive, Eigen::MatrixXd::Identity(33, 33));
  EXPECT_LT(rms_between(nearest, drive), 1e-12);
  const PlannedCycle cycle = pump.planned(drive);
  EXPECT_EQ(cycle.refusal, "");
  EXPECT_NEAR(cycle.stroke_mL, drive.range(), 0.01 * drive.range());
  EXPECT_NEAR(cycle.offset_mL, drive.at(drive.least_at_s()), 1e-6);
  const size_t points = cycle.fraction.size() - 1;
  for (size_t j = 0; j < points; ++j) {
    const double on_curve_s =
        -cycle.lead_s + drive.period_s * static_cast<double>(j) / static_cast<double>(points);
    EXPECT_NEAR(cycle.offset_mL + cycle.stroke_mL * cycle.fraction[j], drive.at(on_curve_s),
                2e-3 * drive.range());
  }
  EXPECT_GT(cycle.trigger_delay_ms + std::abs(cycle.trigger_late_ms), 0.0);
}

TEST(Pump, ADriveBeyondTheLimitsBecomesOneThatTheControllerAccepts) {
  for (const auto& [limits, name] :
       {std::pair{"acceleration_mL_s2 = 900", "acceleration"}, std::pair{"flow_mL_s = 80", "flow"},
        std::pair{"pressure_kPa = 30", "pressure"}, std::pair{"travel_mL = 20", "travel"}}) {
    SCOPED_TRACE(limits);
    const Pump pump(rig_with(limits));
    PeriodicCurve drive = ventricle().with(16);
    drive.c[0] += 1.0;
    EXPECT_EQ(pump.planned(drive).refusal, name);
    const PlannedCycle cycle = pump.planned(pump.nearest(drive, Eigen::MatrixXd::Identity(33, 33)));
    EXPECT_EQ(cycle.refusal, "");
    const auto use = std::ranges::find(cycle.limits, name, &LimitUse::limit);
    EXPECT_GT(use->share(), 0.8);
    EXPECT_LE(use->share(), 1.0);
  }
}

TEST(WantedCurve, ReadsTheExampleAndRefusesWhatDoesNotSayHowLargeItIs) {
  const std::filesystem::path examples = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples";
  const WantedCurve wanted = read_wanted_curve({.file = examples / "shape/ventricle.csv"});
  EXPECT_DOUBLE_EQ(wanted.curve.period_s, 1.2);
  EXPECT_NEAR(wanted.curve.range(), 24.0, 0.05);
  EXPECT_FALSE(wanted.is_pressure);
  EXPECT_THROW((void)read_wanted_curve({.file = examples / "heart.csv"}), InputError);
  const WantedCurve sized =
      read_wanted_curve({.file = examples / "heart.csv", .period_s = 1.5, .stroke_mL = 16.0});
  EXPECT_NEAR(sized.curve.range(), 16.0, 0.1);
}

TEST(WantedCurve, WhatTheFileStatesIsNotStatedByAnOptionToo) {
  const std::filesystem::path examples = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples";
  const auto refusal = [&](const char* file, std::optional<double> period, std::optional<double> stroke_mL) {
    try {
      (void)read_wanted_curve({.file = examples / file, .period_s = period, .stroke_mL = stroke_mL});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("it was accepted");
  };
  EXPECT_THAT(refusal("shape/ventricle.csv", 3.0, {}),
              testing::HasSubstr("option --period-s: is 3, and the file's column time_s says 1.2"));
  EXPECT_THAT(refusal("shape/ventricle.csv", {}, 3.0),
              testing::HasSubstr("option --stroke-mL: is 3, and the file's column volume_mL says 24"));
  EXPECT_THAT(refusal("heart.csv", {}, 3.0), testing::HasSubstr("option --period-s: is missing"));
  EXPECT_THAT(refusal("heart.csv", 0.01, 3.0), testing::HasSubstr("option --period-s: is a cycle of 0.01 s"));
}

TEST(WantedCurve, BetweenFewPointsIsTheControllersCurve) {
  const test::ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "wanted.csv";
  std::ofstream(file) << "time_s,volume_mL\n0,0\n0.6,20\n1.2,0\n";
  const PeriodicCurve curve = read_wanted_curve({.file = file}).curve;
  EXPECT_NEAR(curve.range(), 20.0, 1e-3);
  // 3 u^2 - 2 u^3 of the way up.
  EXPECT_NEAR(curve.at(0.15), 20.0 * 0.15625, 2e-3);
  EXPECT_NEAR(curve.at(0.9), 10.0, 2e-3);
}

TEST(WantedCurve, APressureIsWhatTheColumnsAreNamedAndNotACommentOfIt) {
  const test::ScratchFolder folder;
  const std::filesystem::path file = folder.path() / "wanted.csv";
  const auto read = [&](const std::string& text) {
    std::ofstream(file) << text;
    return read_wanted_curve({.file = file});
  };
  const std::string rows = "0,0\n0.4,5\n0.8,2\n1.2,0\n";
  const WantedCurve volume =
      read("# not pressure_kPa\n\ntime_s,volume_mL # nor pressure_kPa\n" + rows + "# pressure_kPa\n");
  EXPECT_FALSE(volume.is_pressure);
  const WantedCurve pressure = read("# instead of volume_mL\ntime_s, pressure_kPa\n" + rows);
  EXPECT_TRUE(pressure.is_pressure);
  EXPECT_EQ(numbers_of(pressure.curve), numbers_of(volume.curve));
  try {
    (void)read("time_s,pressure_kPa\n0,5\n0.4,7\n0.8,1\n1.2,5\n");
    ADD_FAILURE() << "it was taken";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("line 4: pressure_kPa 1 lies below"));
  }
}

class ShaperTest : public testing::Test {
 protected:
  /// Of `points` through the example's study, whose run states no other limits than the usual ones.
  [[nodiscard]] ShapeRequest request(const std::string& points) const {
    return {.wanted = {.file = write("wanted.csv", points)},
            .study = examples_ / "shape/gel.study.toml",
            .rig = {},
            .plan = {.cycles = 9}};
  }
  [[nodiscard]] std::filesystem::path rig_file(const std::string& limits) const {
    return write("rig.toml",
                 with(read(examples_ / "rig.toml"), "[daq]", "[controller.limits]\n" + limits + "\n[daq]"));
  }
  /// A tube whose wall of 1 mm holds less and less.
  [[nodiscard]] std::filesystem::path thin_study() const {
    const std::string study =
        with(read(examples_ / "shape/gel.study.toml"), "outer_radius_mm = 50.0", "outer_radius_mm = 23.5");
    return write("thin.study.toml", with(study, "../paper-gap", (examples_ / "paper-gap").string()));
  }
  static std::string with(std::string text, const std::string& what, const std::string& by) {
    return text.replace(text.find(what), what.size(), by);
  }
  static std::string read(const std::filesystem::path& file) {
    std::ifstream stream(file);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  [[nodiscard]] std::filesystem::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_.path() / name) << text;
    return folder_.path() / name;
  }
  static std::string refusal(const ShapeRequest& request) {
    try {
      require_playable(Shaper(request).after({}));
    } catch (const InputError& error) {
      return error.what();
    }
    return "it was accepted";
  }

  const std::filesystem::path examples_ = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples";
  const test::ScratchFolder folder_;
};

/// 40 kPa were an offset of 178 mL, from a specimen's curve that ended at 56 mL.
TEST_F(ShaperTest, RefusesAPressureBeyondTheRigsLimitOrTheSpecimen) {
  const std::string high = "time_s,pressure_kPa\n0,0\n0.4,40\n0.8,16\n1.2,0\n";
  EXPECT_THAT(refusal(request(high)),
              testing::HasSubstr("wanted.csv: line 3: asks for 40 kPa, and the rig's limit cavity_kPa is 6"));
  ShapeRequest thin = request(high);
  thin.study = thin_study();
  thin.rig = rig_file("cavity_kPa = 50");
  EXPECT_THAT(refusal(thin), testing::ContainsRegex(
                                 "wanted.csv: line 3: asks for 40 kPa, and the specimen's pressure rises to "
                                 "[0-9.]+ kPa at [0-9]+ mL at the most"));
}

TEST_F(ShaperTest, RefusesAVolumeBeyondTheRigsLimitOrTheSpecimen) {
  const std::string large = "time_s,volume_mL\n0,0\n0.4,2000\n0.8,800\n1.2,0\n";
  EXPECT_THAT(
      refusal(request(large)),
      testing::ContainsRegex("wanted.csv: line 3: asks for 2000 mL, and the specimen holds [0-9.]+ kPa at "
                             "[0-9]+ mL: the rig's limit cavity_kPa is 6"));
  ShapeRequest thin = request(large);
  thin.study = thin_study();
  EXPECT_THAT(refusal(thin), testing::ContainsRegex(
                                 "wanted.csv: line 3: asks for 2000 mL, and the specimen's pressure rises to "
                                 "[0-9.]+ kPa at [0-9]+ mL at the most"));
}

TEST_F(ShaperTest, RefusesADriveWithWhichTheSpecimenHoldsMoreThanTheRigsLimit) {
  ShapeRequest moderate = request(read(examples_ / "shape/ventricle.csv"));
  EXPECT_EQ(refusal(moderate), "it was accepted");
  moderate.rig = rig_file("cavity_kPa = 2.5");
  EXPECT_THAT(
      refusal(moderate),
      testing::ContainsRegex("wanted.csv: drive: with it the specimen is expected to hold 3[.0-9]* kPa, "
                             "and the rig's limit cavity_kPa is 2.5"));
}

TEST_F(ShaperTest, SaysInWordsWhichWaveformTheControllerWouldRefuse) {
  std::string waves = "time_s,volume_mL\n";
  for (int i = 0; i <= 400; ++i)
    waves += fmt::format("{:.3f},{:.5f}\n", 0.03 * i, 4.0 * (1.0 - std::cos(2.0 * M_PI * 20.0 * i / 400.0)));
  EXPECT_THAT(refusal(request(waves)), testing::HasSubstr("drive: the controller would refuse its waveform"));
  const std::string less_than_a_step = "time_s,volume_mL\n0,0\n0.4,1e-6\n0.8,5e-7\n1.2,0\n";
  EXPECT_THAT(refusal(request(less_than_a_step)), testing::HasSubstr("by its limit stroke_at_least"));
}

TEST(DriveFile, ARunKnowsWhereTheWantedCurveBegins) {
  const Pump pump(rig_with(""));
  PeriodicCurve drive = ventricle().with(16);
  drive.c[0] += 1.0;
  const PlannedCycle cycle = pump.planned(drive);
  const std::string points = points_text(cycle, "ventricle.csv");
  runfile::RecordedRun run = PlantForShape({}, plan).play(drive).run;
  run.waveforms.at(0) = {points, {}, cycle.fraction};
  const GatedRun gated = gated_run(run, gel_model(), period_s, 16);
  EXPECT_LT(rms_between(gated.drive_mL, drive), 2e-3 * drive.range());
  run.pump = {};
  EXPECT_THROW((void)gated_run(run, gel_model(), period_s, 16), InputError);
}

}  // namespace
}  // namespace diastole::shaping
