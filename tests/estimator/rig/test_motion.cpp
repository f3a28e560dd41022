#include <gtest/gtest.h>

#include <cmath>

#include "estimator/rig/motion.hpp"

namespace diastole::rig {
namespace {

constexpr double step_mL = 0.0078;

runfile::RecordedRun counted(const Motion& motion, std::vector<runfile::Segment> segments, double end_s) {
  runfile::RecordedRun run;
  run.rig["volume_per_step_mL"] = step_mL;
  run.segments = std::move(segments);
  for (double t = 0.0; t < end_s; t += 1.0 / 300.0) {
    run.pump.time_s.push_back(t);
    run.pump.commanded_mL.push_back(std::round(motion.at(t).volume_mL / step_mL) * step_mL);
  }
  return run;
}

void expect_same(const Motion& found, const Motion& truth, double end_s, double flow_mL_per_s,
                 double acceleration) {
  for (double t = 0.0; t < end_s; t += 0.01) {
    EXPECT_NEAR(found.at(t).flow_mL_per_s, truth.at(t).flow_mL_per_s, flow_mL_per_s) << t;
    EXPECT_NEAR(found.at(t).acceleration_mL_per_s2, truth.at(t).acceleration_mL_per_s2, acceleration) << t;
  }
}

TEST(Motion, VolumeFlowAndAccelerationBelongTogether) {
  const Motion motion({{1.0, 2.0, 0.0, 30.0, 0.2}, {2.5, 3.5, 30.0, 10.0, 0.5, true}}, 0.0, 0.05);
  const double h = 1e-5;
  for (double t = 0.9; t < 3.6; t += 0.0137) {
    const auto now = motion.at(t);
    EXPECT_NEAR((motion.at(t + h).volume_mL - motion.at(t - h).volume_mL) / (2.0 * h), now.flow_mL_per_s,
                1e-5);
    EXPECT_NEAR((motion.at(t + h).flow_mL_per_s - motion.at(t - h).flow_mL_per_s) / (2.0 * h),
                now.acceleration_mL_per_s2, 0.2);
  }
  EXPECT_NEAR(motion.at(0.0).volume_mL, 0.0, 1e-12);
  EXPECT_NEAR(motion.at(9.0).volume_mL, 10.0, 1e-9);
}

TEST(Motion, IsFoundExactlyBehindNamedWaveforms) {
  std::vector<Stroke> strokes;
  for (int cycle = 0; cycle < 3; ++cycle) {
    const double start = 1.0 + 1.2 * cycle;
    strokes.push_back({start, start + 0.6, 0.0, 40.0});
    strokes.push_back({start + 0.6, start + 1.2, 40.0, 0.0});
  }
  const Motion truth(strokes, 0.0, 0.05);
  const FoundMotion found = find_motion(
      counted(truth, {{0.0, "hold", 0.0, 1.0, 0.0, 1}, {1.0, "parabolic", 40.0, 1.2, 0.0, 3}}, 6.0));
  EXPECT_TRUE(found.explained);
  EXPECT_NEAR(found.motion.spread_s(), 0.05, 1e-9);
  EXPECT_LE(found.worst_mL, 0.51 * step_mL);
  expect_same(found.motion, truth, 6.0, 1e-6, 1e-6);
}

TEST(Motion, IsTheSameInEachCycleBehindAnotherMakersSawtooth) {
  constexpr double blended = 0.15;  // of either flank, not 1/25 of the cycle
  std::vector<Stroke> strokes;
  for (int cycle = 0; cycle < 5; ++cycle) {
    const double start = 1.0 + 2.3 * cycle;
    strokes.push_back({start, start + 1.725, 0.0, 18.0, blended});
    strokes.push_back({start + 1.725, start + 2.3, 18.0, 0.0, blended});
  }
  const Motion truth(strokes, 0.0, 0.0);
  const FoundMotion found = find_motion(
      counted(truth, {{0.0, "hold", 0.0, 1.0, 0.0, 1}, {1.0, "sawtooth", 18.0, 2.3, 0.0, 5}}, 14.0));
  EXPECT_TRUE(found.explained);
  EXPECT_TRUE(
      find_motion(
          counted(truth, {{1.0, "sawtooth", 18.0, 2.3, 0.0, 5}, {14.5, "sawtooth", 9.0, 2.3, 0.0, 5}}, 14.0))
          .explained)
      << "the second was never played";
  for (double t = 1.05; t < 1.05 + 3 * 2.3; t += 0.1)
    EXPECT_NEAR(found.motion.at(t).acceleration_mL_per_s2, found.motion.at(t + 2.3).acceleration_mL_per_s2,
                1e-6)
        << t;
  expect_same(found.motion, truth, 14.0, 0.2, 40.0);  // of 37 mL/s and 430 mL/s^2
}

TEST(Motion, IsFoundBehindUnnamedRamps) {
  const Motion truth({{1.0, 2.0, 0.0, 30.0, 0.2}, {4.0, 4.8, 30.0, 0.0, 0.3}}, 0.0, 0.02);
  const FoundMotion found = find_motion(counted(truth, {{1.0, "trapezoidal", 30.0, 5.0, 0.0, 1}}, 6.0));
  EXPECT_TRUE(found.explained);
  EXPECT_NEAR(found.motion.spread_s(), 0.02, 0.011);
  expect_same(found.motion, truth, 6.0, 0.2,
              25.0);  // of 40 mL/s and 190 mL/s^2: corners move by a millisecond
}

TEST(Motion, SaysWhenNothingExplainsTheSteps) {
  runfile::RecordedRun run = counted(Motion({}, 0.0, 0.0), {{1.0, "uploaded", 20.0, 4.0, 0.0, 1}}, 6.0);
  for (size_t k = 0; k < run.pump.time_s.size(); ++k) {
    const double t = run.pump.time_s[k];
    if (t > 1.0)
      run.pump.commanded_mL[k] = std::round((5.0 * std::sin(3.0 * t * t) + 8.0 * t) / step_mL) * step_mL;
  }
  const FoundMotion found = find_motion(run);
  EXPECT_FALSE(found.explained);
  EXPECT_NEAR(found.motion.at(2.0).volume_mL, 5.0 * std::sin(12.0) + 16.0, 0.5);
}

}  // namespace
}  // namespace diastole::rig
