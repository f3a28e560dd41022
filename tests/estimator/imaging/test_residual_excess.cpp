#include <gtest/gtest.h>

#include <random>

#include "estimator/imaging/tracking/residual_excess.hpp"

namespace diastole::imaging {
namespace {

constexpr int pixels = 60, square = 5, striped_rows = 10;

/// Noise all over a wall, and in its first rows stripes that are the same in every phase.
std::vector<TrackedPhase> phases(double stripes, unsigned seed) {
  std::mt19937 engine(seed);
  std::normal_distribution<float> noise(0.0F, 3.0F);
  std::vector<TrackedPhase> all(16);
  for (TrackedPhase& phase : all) {
    phase.noise = 3.0;
    phase.residual = Image::NullaryExpr(pixels, pixels, [&]() { return noise(engine); });
    phase.depth_mm = Eigen::ArrayXXf::Constant(pixels, pixels, 10.0F);
    for (int row = 0; row < striped_rows; ++row)
      phase.residual.row(row) += static_cast<float>(3.0 * stripes) * (row % 2 == 0 ? 1.0F : -1.0F);
  }
  return all;
}

SlicePlane plane() {
  SlicePlane plane;
  plane.rows = plane.columns = pixels;
  return plane;
}

/// Mean over the rows.
double mean_excess(const ResidualExcess& excess, const TrackedPhase& phase, int from, int to) {
  double sum = 0;
  for (int row = from; row < to; ++row)
    for (int column = 0; column < pixels; ++column)
      sum += excess.at(phase, row, column);
  return sum / (pixels * (to - from));
}

TEST(ResidualExcess, IsFoundWhereStripesLieOverTheNoiseAndNowhereElse) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const std::vector<TrackedPhase> seen = phases(1.0, seed);
    const ResidualExcess excess(seen, plane(), square);
    // Stripes of one standard deviation double the variance; residuals count three standard deviations at most, and two standard errors of
    // 16 x 25 pixels, of which each second is new, are a fifth.
    EXPECT_NEAR(mean_excess(excess, seen[0], 0, striped_rows), 0.74, 0.08) << seed;
    EXPECT_LT(mean_excess(excess, seen[0], striped_rows, pixels), 0.005) << seed;
    EXPECT_FALSE(excess.is_clean(0, 0));
    EXPECT_NEAR(excess.over_phases(seen[0], 0, 0), 1 + 16 * excess.at(seen[0], 0, 0), 1e-12);
  }
}

TEST(ResidualExcess, HoldsNothingWhereThereIsNoiseOnly) {
  size_t found = 0, all = 0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const std::vector<TrackedPhase> seen = phases(0.0, seed);
    const ResidualExcess excess(seen, plane(), square);
    for (int row = 0; row < pixels; row += square)
      for (int column = 0; column < pixels; column += square, ++all)
        found += excess.is_clean(row, column) ? 0 : 1;
  }
  // White noise has half the variance of what the two standard errors allow for.
  EXPECT_LT(found, 0.01 * static_cast<double>(all));
}

}  // namespace
}  // namespace diastole::imaging
