#include "estimator/inference/linear_model.hpp"

namespace diastole::inference {
namespace {

/// chi-square = (x + y - 3)^2 + (x - y)^2 / 4 + z^2, from nothing.
LinearModel three_unknowns() {
  LinearModel model{Eigen::Vector3d::Zero(), Eigen::Vector3d(-3.0, 0.0, 0.0), {}};
  model.jacobian = Eigen::Matrix3d{{1.0, 1.0, 0.0}, {0.5, -0.5, 0.0}, {0.0, 0.0, 1.0}};
  return model;
}

TEST(LinearModel, MovesToItsMinimum) {
  LinearModel model = three_unknowns();
  move_to_minimum(model, ParameterSpace({{"x"}, {"y"}, {"z"}}), {true, true, true});
  EXPECT_LT((model.q - Eigen::Vector3d(1.5, 1.5, 0.0)).norm(), 1e-12);
  EXPECT_LT(model.chi_square(), 1e-24);
}

TEST(LinearModel, BesideABoundThatStopsOneTheOthersHaveTheirOwnMinimum) {
  LinearModel model = three_unknowns();
  const ParameterSpace space({{"x", "", 0.0, 0.5}, {"y"}, {"z"}});
  move_to_minimum(model, space, {true, true, true});
  // At x = 0.5 chi-square is least where y - 2.5 + (y - 0.5) / 4 = 0.
  EXPECT_LT((model.q - Eigen::Vector3d(0.5, 2.1, 0.0)).norm(), 1e-12);
  EXPECT_NEAR(model.chi_square(), 0.4 * 0.4 + 1.6 * 1.6 / 4.0, 1e-12);
  EXPECT_EQ(space.free_unknowns(model.q), std::vector<bool>({false, true, true}));
}

TEST(LinearModel, WhatOvershootsOnlyBesideAnotherThatABoundStopsIsNotHeld) {
  // Unbounded x would be 10 and y -8, both far beyond.
  LinearModel model{Eigen::Vector2d::Zero(), Eigen::Vector2d(-2.8, 0.8), {}};
  model.jacobian = Eigen::Matrix2d{{1.0, 0.9}, {0.0, 0.1}};
  move_to_minimum(model, ParameterSpace({{"x", "", -1.0, 1.0}, {"y", "", -1.0, 5.0}}), {true, true});
  // At x = 1 chi-square is (0.9 y - 1.8)^2 + (0.1 y + 0.8)^2.
  EXPECT_LT((model.q - Eigen::Vector2d(1.0, 1.54 / 0.82)).norm(), 1e-12);
}

TEST(LinearModel, WhatABoundStoppedOnTheWayIsLetGo) {
  // From x = 0.9 the whole step leads beyond x = 1 first; beside y at its bound x is better off within.
  LinearModel model{Eigen::Vector2d(0.9, 0.0), {}, {}};
  model.jacobian = Eigen::Matrix2d{{1.0, -0.95}, {0.0, 0.3}};
  model.residuals = model.jacobian * (model.q - Eigen::Vector2d(8.0, 8.0));
  const ParameterSpace space({{"x", "", -1.0, 1.0}, {"y", "", -1.0, 0.5}});
  move_to_minimum(model, space, {true, true});
  EXPECT_LT((model.q - Eigen::Vector2d(0.875, 0.5)).norm(), 1e-12);  // x - 8 = 0.95 (y - 8)
}

TEST(LinearModel, WhatIsNotFreeStays) {
  LinearModel model = three_unknowns();
  move_to_minimum(model, ParameterSpace({{"x"}, {"y", "", 0.0, 1.0}, {"z"}}), {false, true, false});
  EXPECT_EQ(model.q, Eigen::Vector3d(0.0, 1.0, 0.0));
  EXPECT_NEAR(model.chi_square(), 4.25, 1e-12);
}

}  // namespace
}  // namespace diastole::inference
