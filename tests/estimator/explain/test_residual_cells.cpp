#include <gmock/gmock.h>

#include <random>

#include "estimator/explain/rig/residual_cells.hpp"
#include "estimator/explain/verdict/chi_square.hpp"

namespace diastole::explain {
namespace {

constexpr size_t cycles = 20;
constexpr size_t samples = 360;  // of a cycle

/// One run of parabolic cycles after a second of rest.
rig::Session one_run() {
  rig::SessionRun run;
  run.drive.place.name = "baseline";
  for (size_t c = 0; c < cycles; ++c)
    run.drive.place.trigger_s.push_back(1.0 + 1.2 * static_cast<double>(c));
  run.segments = {{1.0, "parabolic", 40.0, 1.2, 0.0, static_cast<int64_t>(cycles)}};
  for (size_t k = 0; k < 300 + cycles * samples + 150; ++k)
    run.sample_s.push_back(static_cast<double>(k) / 300.0);
  rig::Session session;
  session.runs.push_back(run);
  return session;
}

class Cells : public testing::Test {
 protected:
  Cells() {
    std::mt19937 generator(7);
    std::normal_distribution<double> normal;
    for (double& value : residuals_)
      value = normal(generator);
  }
  std::vector<ResidualCell> found() {
    return significant(residual_cells(session_, blocks_, residuals_, variance_), 0.01);
  }

  rig::Session session_ = one_run();
  Eigen::Index rows_ = static_cast<Eigen::Index>(session_.runs[0].sample_s.size());
  std::vector<rig::ResidualBlock> blocks_{{0, "cavity_kPa", 0, static_cast<size_t>(rows_)}};
  Eigen::VectorXd residuals_ = Eigen::VectorXd::Zero(rows_);
  Eigen::VectorXd variance_ = Eigen::VectorXd::Zero(rows_);
};

TEST_F(Cells, NoiseShowsNothing) { EXPECT_THAT(found(), testing::IsEmpty()); }

TEST_F(Cells, WhatRepeatsInEveryCycleIsFoundInItsPhaseThoughItIsSmall) {
  for (size_t c = 0; c < cycles; ++c)
    for (size_t j = 150; j < 175; ++j)
      residuals_[static_cast<Eigen::Index>(300 + c * samples + j)] += 0.6;
  const auto cells = found();
  ASSERT_FALSE(cells.empty());
  for (const ResidualCell& cell : cells)
    EXPECT_NEAR(cell.phase.value_or(std::array{0.4, 0.5})[0], 0.4, 0.01);
  EXPECT_TRUE(
      std::any_of(cells.begin(), cells.end(), [](const auto& cell) { return cell.kind == CellKind::shape; }));
}

TEST_F(Cells, AToneIsFoundInItsBand) {
  for (Eigen::Index k = 0; k < rows_; ++k)
    residuals_[k] += 0.3 * std::sin(2.0 * M_PI * 9.37 * static_cast<double>(k) / 300.0);
  const auto cells = found();
  ASSERT_FALSE(cells.empty());
  const auto band =
      std::find_if(cells.begin(), cells.end(), [](const auto& cell) { return cell.kind == CellKind::band; });
  ASSERT_NE(band, cells.end());
  EXPECT_LT((*band->band_Hz)[0], 9.37);
  EXPECT_GT((*band->band_Hz)[1], 9.37);
}

TEST_F(Cells, WhatTheModelMayErrByIsNoDiscovery) {
  for (size_t c = 0; c < cycles; ++c)
    for (size_t j = 150; j < 175; ++j)
      residuals_[static_cast<Eigen::Index>(300 + c * samples + j)] += 0.3;
  EXPECT_FALSE(found().empty());
  variance_.setConstant(0.25);
  EXPECT_TRUE(found().empty());
}

TEST(ChiSquare, TailsAndDiscoveries) {
  EXPECT_NEAR(chi_square_tail(3.841459, 1.0), 0.05, 1e-6);
  EXPECT_NEAR(chi_square_exceeded(0.05, 1.0), 3.841459, 1e-5);
  EXPECT_EQ(chi_square_tail(-1.0, 5.0), 1.0);
  EXPECT_EQ(discovery_limit({0.5, 0.9, 0.2}, 0.01), 0.0);
  EXPECT_EQ(discovery_limit({0.004, 0.5, 0.006, 0.9}, 0.02), 0.006);
}

}  // namespace
}  // namespace diastole::explain
