#include "tools/benchmarks/figure_targets.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace diastole {
namespace {

TEST(FigureTargets, MarksWhatMissesItsTarget) {
  FigureTargets targets;
  EXPECT_EQ(targets.at_most(1.0, 1.0, "{:.1f} s"), "1.0 s");
  EXPECT_EQ(targets.at_most(1.01, 1.0, "{:.2f} s"), "1.01 s MISSED");
  EXPECT_EQ(targets.at_least(9.9, 10.0, "{:.1f}"), "9.9 MISSED");
  EXPECT_EQ(targets.within(-1.5, -1.0, 1.0, "{:+.1f}"), "-1.5 MISSED");
  EXPECT_EQ(targets.at_most(std::nan(""), 1.0), "nan MISSED");
  EXPECT_EQ(targets.mark(true), "");
  EXPECT_EQ(targets.mark(false), " MISSED");
}

TEST(FigureTargets, OneMissedMakesTheExitCode) {
  FigureTargets targets;
  EXPECT_EQ(targets.conclude(), ExitCode::done) << "nothing had a target";
  targets.at_most(1.0, 2.0);
  EXPECT_EQ(targets.conclude(), ExitCode::done);
  targets.at_most(3.0, 2.0);
  targets.at_most(1.0, 2.0);
  testing::internal::CaptureStdout();
  EXPECT_EQ(targets.conclude(), ExitCode::negative);
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "\n1 of 3 figures with a target MISSED it.\n");
}

}  // namespace
}  // namespace diastole
