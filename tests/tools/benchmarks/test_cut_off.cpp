#include "tests/tools/benchmarks/image.hpp"
#include "tests/tools/benchmarks/random_cuts.hpp"

namespace diastole::step_path_test {
namespace {

/// 5 µs are one step period at 200,000 steps/s, the shortest tried.
TEST(CutOff, LeavesAtMostOneStepWithinAStepPeriodAtRandomMoments) {
  NEEDS_IMAGE();
  const CutFigures figures = cut_at_random(12, 1);
  EXPECT_EQ(figures.cuts, 12);
  EXPECT_LE(figures.most_steps_over, 1);
  EXPECT_LE(figures.worst_ns, 5'000U);
  EXPECT_GE(figures.shortest_pulse_ns, 1'999U) << "a pulse of 2 us was cut short";
}

}  // namespace
}  // namespace diastole::step_path_test
