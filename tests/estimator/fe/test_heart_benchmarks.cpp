// Published and independently computed heart problems on coarse meshes; test_heart_refinement.cpp refines.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/model/study_model.hpp"
#include "tests/estimator/fe/land.hpp"

namespace diastole {
namespace {

TEST(LandBenchmark, BeamBends) {
  const Eigen::Vector3d tip = land_beam_tip_mm({10, 1, 1});
  EXPECT_NEAR(tip[0], 9.177, 0.003);
  EXPECT_NEAR(tip[2], 4.168, 0.005);
}

TEST(LandBenchmark, EllipsoidInflates) {
  const LandVentricle inflated = stable(land_inflated(land_ellipsoid({8, 4, 1})));
  EXPECT_NEAR(inflated.model.cavity_volume_mL(inflated.model.rest_state()), 2.492, 0.001);
  EXPECT_NEAR(inflated.cavity_mL(), 10.73, 0.02);
  EXPECT_NEAR(inflated.apex_mm(0.0), -26.612, 0.1);
  EXPECT_NEAR(inflated.apex_mm(0.5), -27.300, 0.1);
  EXPECT_NEAR(inflated.apex_mm(1.0), -28.280, 0.1);
}

TEST(LandBenchmark, EllipsoidContracts) {
  const LandVentricle contracted = stable(land_contracted(land_ellipsoid({8, 4, 2})));
  EXPECT_NEAR(contracted.cavity_mL(), 1.796, 0.006);
  EXPECT_NEAR(contracted.apex_mm(0.5), -14.22, 0.06);
  EXPECT_NEAR(contracted.apex_mm(1.0), -15.47, 0.08);
  EXPECT_NEAR(contracted.twist_deg(0.25), -22.4, 0.15);
  EXPECT_NEAR(contracted.twist_deg(0.50), -12.9, 0.15);
  EXPECT_NEAR(contracted.twist_deg(0.75), -6.2, 0.15);
}

// Noise-free displacements of an independent solver at known parameters; every twentieth of its points.
TEST(LeftVentricle, MovesAsAnIndependentSolverSays) {
  const std::filesystem::path examples = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples";
  Study study = read_study(examples / "lv-clean.study.toml");
  for (const char* truth : {"C_kPa=3", "b1=11.09", "b2=1.76", "b3=10"})
    set_start(study, truth);
  const Measurement measurement = read_measurement(study);
  ElasticModel model = make_model(study);
  const PointLocator locator(model.mesh(), model.mesh().reference(), {.outside_xi = 0.02});
  constexpr std::array<double, 5> volume_change_mL{7.162, 15.0303, 22.7853, 29.861, 36.0909};
  ElasticState state = model.rest_state();
  const double rest_mL = model.cavity_volume_mL(state);
  EXPECT_NEAR(rest_mL, 67.2874, 0.02);
  for (size_t frame = 1; frame <= 5; ++frame) {
    const Solution solution = model.solve(measurement.frames[frame].pressure_kPa, state);
    ASSERT_TRUE(solution.report.converged()) << solution.report.describe();
    state = solution.state;
    EXPECT_NEAR((model.cavity_volume_mL(state) - rest_mL) / volume_change_mL[frame - 1], 1.0, 0.001);
    double sum = 0.0;
    size_t count = 0;
    for (const auto& point : measurement.points) {
      if (static_cast<size_t>(point.frame) != frame) continue;
      const auto found = locator.find(Eigen::Map<const Eigen::Vector3d>(point.X_mm.data()));
      ASSERT_TRUE(found);
      const Eigen::Vector3d moved = model.mesh().value(state.position_mm, found->point);
      sum += (moved - Eigen::Map<const Eigen::Vector3d>(point.x_mm.data())).squaredNorm();
      ++count;
    }
    EXPECT_EQ(count, 200U);
    EXPECT_LT(std::sqrt(sum / static_cast<double>(count)), 0.02) << "frame " << frame;
  }
}

}  // namespace
}  // namespace diastole
