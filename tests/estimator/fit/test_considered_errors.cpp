// Errors of fibres and walls that the fit does not seek: what they add to its errors is what they do to its estimate.

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/fit/considered_errors.hpp"
#include "estimator/fit/elastic_motion.hpp"
#include "estimator/fit/fit.hpp"
#include "tests/estimator/fe/ventricle.hpp"

namespace diastole {
namespace {

const EllipsoidShape heart{.elements = {6, 3, 1}};

ElasticModel nominal() { return ventricle(heart, {60.0, -60.0}, {3.0, 11.09, 1.76, 10.0}); }

/// Exact displacements of a body at two pressures, reported of the places that the nominal body has at the same xi.
Measurement motion_of(ElasticModel truth) {
  Measurement measurement;
  measurement.frames.push_back({0.0, 0.0, 0.0});
  for (const double pressure_kPa : {0.5, 1.0}) {
    const auto frame = static_cast<int>(measurement.frames.size());
    measurement.frames.push_back({0.1 * frame, pressure_kPa, 0.0});
    const NodeField position = truth.solve(pressure_kPa).state.position_mm;
    for (size_t e = 0; e < truth.mesh().element_count(); ++e) {
      for (size_t sample = 0; sample < 27; ++sample) {
        const MaterialPoint point{
            e,
            {0.1 + 0.4 * static_cast<double>(sample % 3), 0.1 + 0.4 * static_cast<double>(sample / 3 % 3),
             0.1 + 0.4 * static_cast<double>(sample / 9)}};
        const Eigen::Vector3d X = truth.mesh().value(truth.mesh().reference(), point);
        const Eigen::Vector3d x = truth.mesh().value(position, point);
        measurement.points.push_back({frame, {X[0], X[1], X[2]}, {x[0], x[1], x[2]}, 0.3});
      }
    }
  }
  return measurement;
}

/// How far the estimate of C moves when the body has one standard deviation of the error, over what the error's share of the variance says.
double shift_over_prediction(const ConsideredError& error) {
  ElasticMotion motion(nominal(), {whole_parameter(0)});
  motion.consider({error});
  FitOptions options;
  options.robustness = Robustness::never;
  options.locator = {.outside_xi = 0.25};
  const std::vector<EstimatedParameter> C{{2.5, 0.5, 12.0, "C_kPa"}};
  const FitOutcome fit = fit_motion(motion, C, motion_of(error.with(nominal(), error.sigma)), options);
  EXPECT_TRUE(fit.converged()) << fit.reason;
  const EstimatedValue& found = fit.values[0];
  EXPECT_TRUE(found.shares);
  const FittedVarianceShares shares = found.shares.value_or(FittedVarianceShares{});
  EXPECT_NEAR(shares.images + shares.pressures + shares.fibres + shares.geometry, 1.0, 1e-9);
  return std::abs(found.value - 3.0) / (found.se * std::sqrt(shares.fibres + shares.geometry));
}

TEST(ConsideredErrors, HelixShiftsTheEstimateAsTheyPredict) {
  EXPECT_NEAR(shift_over_prediction(fibre_errors(nominal(), 1.0)[0]), 1.0, 0.2);
}
TEST(ConsideredErrors, HelixThroughTheWallLikewise) {
  EXPECT_NEAR(shift_over_prediction(fibre_errors(nominal(), 5.0)[1]), 1.0, 0.2);
}
TEST(ConsideredErrors, InnerWallLikewise) {
  EXPECT_NEAR(shift_over_prediction(geometry_errors(nominal(), 0.3)[0]), 1.0, 0.2);
}

TEST(ConsideredErrors, WallsMoveAlongTheirNormals) {
  const ElasticModel model = nominal();
  const ConsideredError inner = geometry_errors(model, 0.3)[0];
  for (size_t e = 0; e < model.mesh().element_count(); ++e) {
    const bool apical = e < 6;
    for (const double depth : {0.0, 1.0}) {
      const MaterialPoint point{e, {0.5, 0.5, depth}};
      const Eigen::Vector3d moved = model.mesh().value(inner.shape, point);
      const Eigen::Vector3d normal = wall_axes(model.mesh(), point).col(2);
      EXPECT_NEAR(moved.dot(normal), 1.0 - depth, 0.05);
      EXPECT_LT((moved - moved.dot(normal) * normal).norm(), apical ? 0.12 : 0.05);
    }
  }
}

TEST(ConsideredErrors, AMovedWallLeavesTheApexWhole) {
  const ElasticModel model = nominal();
  const HermiteMesh moved = geometry_errors(model, 0.25)[0].with(model, 0.5).mesh();
  for (size_t e = 0; e < 6; ++e) {
    for (const double from_apex : {0.02, 0.07, 0.3}) {
      for (const double depth : {0.07, 0.5, 0.93}) {
        const MaterialPoint point{e, {0.67, from_apex, depth}};
        const double before = model.mesh().xi_gradient(model.mesh().reference(), point).determinant();
        // The wall of 9 mm is 0.5 mm thinner, and at most wider by twice 0.5 mm over the apex's radius of 8.6 mm.
        EXPECT_NEAR(moved.xi_gradient(moved.reference(), point).determinant() / before, 1.0, 0.1);
      }
    }
  }
}

TEST(ConsideredErrors, NothingStatedAddsNothing) {
  ElasticMotion motion(nominal(), {whole_parameter(0)});
  const FitOutcome fit = fit_motion(motion, {{2.5, 0.5, 12.0, "C_kPa"}}, motion_of(nominal()), {});
  ASSERT_TRUE(fit.values[0].shares);
  EXPECT_EQ(fit.values[0].shares->fibres, 0.0);
  EXPECT_EQ(fit.values[0].shares->geometry, 0.0);
  EXPECT_NEAR(fit.values[0].shares->images, 1.0, 1e-9);  // pressures exactly known
}

}  // namespace
}  // namespace diastole
