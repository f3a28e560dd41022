#include "estimator/motion_residuals/motion_residuals.hpp"

#include <gmock/gmock.h>

#include "estimator/mesh/annulus.hpp"
#include "tests/estimator/motion_residuals/mapped_field.hpp"

namespace diastole {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using test::mapped;

std::array<double, 3> array_of(const Vector3d& v) { return {v[0], v[1], v[2]}; }

HermiteMesh annulus(std::array<size_t, 3> elements) {
  AnnulusShape shape;
  shape.elements = elements;
  return make_annulus(shape);
}

/// Of x by y.
Matrix3d sheared(double by) {
  Matrix3d F = Matrix3d::Identity();
  F(0, 1) = by;
  return F;
}

class Residuals : public testing::Test {
 protected:
  Residuals() : mesh_(annulus({4, 2, 1})), reference_(mesh_, mesh_.reference()) {
    direction_ << 0.3, -0.2, 0.1, 0.5, 0.4, -0.3, 0.2, 0.1, -0.6;
    measurement_.frames.resize(4);
  }

  /// Seen in a motion x = F X, so much too far along its normal.
  void add_tag(int frame, const Vector3d& X_mm, const Vector3d& normal, const Matrix3d& F, double error_mm) {
    measurement_.tags.push_back(
        {frame, array_of(normal), normal.dot(X_mm), array_of(F * X_mm + error_mm * normal), 0.5});
  }

  /// Eleven across z, near the x axis.
  void add_steady_tags() {
    for (int i = 0; i < 11; ++i)
      add_tag(1, {30.0 + i, 0.3 * i, -20.0 + 4.0 * i}, Vector3d::UnitZ(), Matrix3d::Identity(), 0.1 * i);
  }
  /// One that a shear by 1.9 turns so far that n . F^-1 n = 0.05.
  void add_wild_tag(double y_mm) {
    add_tag(1, {32, y_mm, 0}, Vector3d(1, 1, 0).normalized(), Matrix3d::Identity(), 0.7);
  }

  [[nodiscard]] MotionResiduals found(const Matrix3d& F) const {
    MotionResiduals residuals(measurement_, loaded_frames(measurement_), {});
    residuals.find(mesh_, reference_, std::vector(residuals.frames().size(), mapped(mesh_.reference(), F)));
    return residuals;
  }
  [[nodiscard]] bool follow(MotionResiduals& residuals, const Matrix3d& F,
                            Following how = Following::exactly) const {
    return residuals.follow(mesh_, reference_,
                            std::vector(residuals.frames().size(), mapped(mesh_.reference(), F)), how);
  }
  [[nodiscard]] Eigen::VectorXd followed(MotionResiduals residuals, const Matrix3d& F,
                                         Following how = Following::exactly) const {
    EXPECT_TRUE(follow(residuals, F, how));
    return residuals.residuals();
  }

  HermiteMesh mesh_;
  PointLocator reference_;
  Matrix3d direction_;
  Measurement measurement_;
};

TEST_F(Residuals, RowsAreTagsThenPointsOfEachLoadedFrame) {
  add_tag(3, {30, 0, 0}, Vector3d::UnitX(), Matrix3d::Identity(), 1.0);
  add_tag(1, {0, 40, 5}, Vector3d::UnitZ(), Matrix3d::Identity(), -0.5);
  add_tag(1, {0, 90, 5}, Vector3d::UnitZ(), Matrix3d::Identity(), 0.0);  // outside the body
  measurement_.points.push_back({1, {0, 30, 0}, {0.25, 30, -1}, 0.25});
  measurement_.points.push_back({0, {0, 30, 0}, {9, 9, 9}, 0.25});
  const MotionResiduals residuals = found(Matrix3d::Identity());
  EXPECT_THAT(residuals.frames(), testing::ElementsAre(1, 3));
  ASSERT_EQ(residuals.size(), 5);
  EXPECT_EQ(residuals.first(1), 4);
  EXPECT_EQ(residuals.count(1), 1);
  EXPECT_EQ(residuals.found().usable, 3U);
  EXPECT_EQ(residuals.found().tags_left_out, 1U);
  const Eigen::VectorXd expected = Eigen::Vector<double, 5>(-1, 1, 0, -4, 2);
  EXPECT_LT((residuals.residuals() - expected).norm(), 1e-7);
  EXPECT_DOUBLE_EQ(residuals.sigmas_mm()[3], 0.25);
}

TEST_F(Residuals, DerivativesByMotionAndByUndeformedMesh) {
  const Matrix3d F = sheared(0.1);
  add_tag(1, {30, 5, 10}, Vector3d(1, 1, 0).normalized(), F, 0.7);
  measurement_.points.push_back({1, {0, 30, 0}, {3.2, 30, -1}, 0.25});
  const MotionResiduals residuals = found(F);
  const NodeField by = mapped(mesh_.reference(), direction_);
  const std::vector<const NodeField*> none{nullptr};
  const std::vector<const NodeField*> some{&by};
  const double h = 1e-5;
  const Eigen::VectorXd by_motion =
      (followed(residuals, F + h * direction_) - followed(residuals, F - h * direction_)) / (2 * h);
  EXPECT_LT((residuals.columns(0, mesh_, some) - by_motion).norm(), 1e-5 * by_motion.norm());

  // X becomes (I + h D) X at fixed mesh coordinates, while x stays.
  const auto on_mesh = [&](double amount) {
    std::vector<HermiteMesh::Corners> elements;
    for (size_t e = 0; e < mesh_.element_count(); ++e)
      elements.push_back(mesh_.element(e));
    const HermiteMesh moved(mapped(mesh_.reference(), Matrix3d::Identity() + amount * direction_), elements,
                            mesh_.faces());
    const PointLocator locator(moved, moved.reference());
    MotionResiduals there = residuals;
    EXPECT_TRUE(there.follow(moved, locator, std::vector<NodeField>{mapped(mesh_.reference(), F)}));
    return there.residuals();
  };
  const Eigen::VectorXd by_reference = (on_mesh(h) - on_mesh(-h)) / (2 * h);
  EXPECT_LT((residuals.columns(0, mesh_, none, some) - by_reference).norm(), 1e-5 * by_reference.norm());
}

TEST_F(Residuals, FollowingCloselyErrsInTheSecondOrder) {
  const auto bent = [&](double amount) {  // a motion that is no linear map
    NodeField position = mapped(mesh_.reference(), Matrix3d::Identity() + amount * direction_);
    for (size_t node = 0; node < mesh_.node_count(); ++node)
      position[dof_of(node, 0, 0)] += 5.0 * amount * static_cast<double>(node % 3);
    return std::vector<NodeField>{position};
  };
  for (int i = 0; i < 8; ++i)
    add_tag(1, {0.1 + 2.0 * i, 35, 3.0 * i}, Vector3d(1, 0, 1).normalized(), Matrix3d::Identity(), 0.3);
  const MotionResiduals begun = found(Matrix3d::Identity());
  const auto error = [&](double amount) {
    MotionResiduals exact = begun;
    MotionResiduals close = begun;
    EXPECT_TRUE(exact.follow(mesh_, reference_, bent(amount)));
    EXPECT_TRUE(close.follow(mesh_, reference_, bent(amount), Following::closely));
    return (exact.residuals() - close.residuals()).norm();
  };
  const double coarse = error(0.02);
  EXPECT_GT(coarse, 1e-8);
  EXPECT_LT(error(0.01), 0.35 * coarse);
}

TEST_F(Residuals, ALostTagKeepsItsResidualAndForbidsNoMotion) {
  add_steady_tags();
  add_wild_tag(0.0);
  for (const Following how : {Following::exactly, Following::closely}) {
    MotionResiduals residuals = found(Matrix3d::Identity());
    ASSERT_EQ(residuals.size(), 12);
    EXPECT_EQ(residuals.give_up_lost(), 0U);
    ASSERT_TRUE(follow(residuals, sheared(1.9), how));
    EXPECT_NEAR(residuals.residuals()[11], 0.7 / 0.5, 1e-8);
    EXPECT_EQ(residuals.rows()[11].by_motion, Vector3d::Zero().eval());
    EXPECT_TRUE(residuals.rows()[11].was_lost);
    EXPECT_GT(residuals.rows()[0].by_motion.norm(), 1.0);

    // It is found again where it can be, unless it was given up.
    ASSERT_TRUE(follow(residuals, Matrix3d::Identity(), how));
    EXPECT_GT(residuals.rows()[11].by_motion.norm(), 1.0);
    EXPECT_EQ(residuals.give_up_lost(), 1U);
    EXPECT_EQ(residuals.find(mesh_, reference_, std::vector<NodeField>{mesh_.reference()}), 0U);
    EXPECT_EQ(residuals.size(), 11);
    EXPECT_EQ(residuals.found().tags_unfollowed, 1U);
  }
}

TEST_F(Residuals, AMotionThatLosesMoreThanATenthIsRefused) {
  add_steady_tags();
  add_wild_tag(0.0);
  add_wild_tag(1.0);
  MotionResiduals residuals = found(Matrix3d::Identity());
  const Eigen::VectorXd before = residuals.residuals();
  EXPECT_FALSE(follow(residuals, sheared(1.9)));
  EXPECT_EQ(residuals.residuals(), before);
  EXPECT_EQ(residuals.give_up_lost(), 0U);
}

TEST_F(Residuals, RowsKeepTheirPlacesOnAnotherMesh) {
  for (int i = 0; i < 6; ++i)
    add_tag(1, {25.0 + 4.0 * i, 3.0 * i, 2.0 * i}, Vector3d(0, 1, 1).normalized(), sheared(0.05), 0.2);
  const MotionResiduals residuals = found(sheared(0.05));
  const HermiteMesh finer = annulus({8, 3, 2});
  const PointLocator locator(finer, finer.reference());
  const MotionResiduals there = residuals.relocated(locator);
  const NodeField here_by = mapped(mesh_.reference(), direction_);
  const NodeField there_by = mapped(finer.reference(), direction_);
  const std::vector<const NodeField*> here_fields{&here_by};
  const std::vector<const NodeField*> there_fields{&there_by};
  EXPECT_LT((residuals.columns(0, mesh_, here_fields) - there.columns(0, finer, there_fields)).norm(), 1e-7);
}

}  // namespace
}  // namespace diastole
