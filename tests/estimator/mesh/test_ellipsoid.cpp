// The truncated ellipsoid: its walls, its apex, and its fibres against the analytic convention.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "estimator/mesh/ellipsoid.hpp"

namespace diastole {
namespace {

double depth_error(const HermiteMesh& mesh, const EllipsoidShape& shape, const MaterialPoint& point,
                   double t) {
  const Eigen::Vector3d x = mesh.value(mesh.reference(), point);
  const double a = std::lerp(shape.inner_axes_mm[0], shape.outer_axes_mm[0], t);
  const double c = std::lerp(shape.inner_axes_mm[1], shape.outer_axes_mm[1], t);
  return std::abs(std::hypot(x.head<2>().norm() / a, x[2] / c) - 1.0);
}

double worst_wall_error(const EllipsoidShape& shape) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  double worst = 0.0;
  for (const ElementFace& face : mesh.faces().inner) {
    for (const Xi& xi : {Xi{0.5, 0.5, 0.0}, Xi{0.2, 0.8, 0.0}, Xi{0.7, 0.1, 0.0}})
      worst = std::max(worst, depth_error(mesh, shape, {face.element, xi}, 0.0));
  }
  return worst;
}

TEST(Ellipsoid, WallsAreEllipsoidsToFourthOrderAndBetter) {
  EllipsoidShape shape;
  EXPECT_LT(worst_wall_error(shape), 2e-3);
  const double coarse = worst_wall_error(shape);
  shape.elements = {16, 8, 2};
  EXPECT_LT(worst_wall_error(shape), coarse / 12.0);
}

TEST(Ellipsoid, UngradedArcsAreBezierArcs) {
  EllipsoidShape shape;
  shape.base_grading = 0.0;
  EXPECT_LT(worst_wall_error(shape), 1e-5);
}

TEST(Ellipsoid, BaseIsFlatAndLayersAreAtTheirDepths) {
  EllipsoidShape shape;
  shape.elements = {6, 3, 3};
  const HermiteMesh mesh = make_ellipsoid(shape);
  EXPECT_TRUE(mesh.faces().bottom.empty());
  EXPECT_EQ(mesh.faces().top.size(), 18U);
  for (const ElementFace& face : mesh.faces().top) {
    for (const Xi& xi : {Xi{0.3, 1.0, 0.2}, Xi{0.9, 1.0, 0.7}})
      EXPECT_NEAR(mesh.value(mesh.reference(), {face.element, xi})[2], 15.0, 1e-10);
  }
  for (size_t layer = 0; layer < 3; ++layer) {
    const double t = (static_cast<double>(layer) + 0.5) / 3.0;
    EXPECT_LT(depth_error(mesh, shape, {layer * 18 + 7, {0.0, 0.0, 0.5}}, t), 1e-4);
  }
}

TEST(Ellipsoid, ReferenceKeepsToTheApexTies) {
  const HermiteMesh mesh = make_ellipsoid({});
  EXPECT_EQ(mesh.ties().same.size(), 3U * 7U * 6U);
  for (const auto& [dof, other] : mesh.ties().same)
    EXPECT_DOUBLE_EQ(mesh.reference()[dof], mesh.reference()[other]);
  for (const size_t dof : mesh.ties().zero)
    EXPECT_EQ(mesh.reference()[dof], 0.0);
  EXPECT_EQ(mesh.place_of(5), 0U);
  EXPECT_EQ(mesh.place_of(9), 9U);
}

/// The convention in closed form: theta = atan2(Y, X), psi = atan2(R / a, -Z / c), e_l ~ a cos psi e_R + c sin
/// psi e_z, r = e_c x e_l, f = cos alpha e_c + sin alpha e_l, alpha linear in depth t.
Eigen::Matrix3d analytic_axes(const EllipsoidShape& shape, const Eigen::Vector3d& x, double t, double alpha) {
  const double a = std::lerp(shape.inner_axes_mm[0], shape.outer_axes_mm[0], t);
  const double c = std::lerp(shape.inner_axes_mm[1], shape.outer_axes_mm[1], t);
  const double theta = std::atan2(x[1], x[0]);
  const double psi = std::atan2(x.head<2>().norm() / a, -x[2] / c);
  const Eigen::Vector3d outwards(std::cos(theta), std::sin(theta), 0.0);
  const Eigen::Vector3d around(-std::sin(theta), std::cos(theta), 0.0);
  const Eigen::Vector3d along =
      (a * std::cos(psi) * outwards + c * std::sin(psi) * Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d axes;
  axes.col(2) = around.cross(along);
  axes.col(0) = std::cos(alpha) * around + std::sin(alpha) * along;
  axes.col(1) = axes.col(2).cross(axes.col(0));
  return axes;
}

TEST(FibreField, FollowsTheVentriclesConvention) {
  EllipsoidShape shape;
  shape.elements = {8, 8, 2};
  const HermiteMesh mesh = make_ellipsoid(shape);
  const FibreField fibres = ellipsoid_fibres(shape, 60.0, -60.0);
  for (size_t e = 0; e < mesh.element_count(); e += 3) {
    for (const Xi& xi : {Xi{0.07, 0.07, 0.07}, Xi{0.5, 0.33, 0.67}, Xi{0.93, 0.93, 0.33}}) {
      const double t = (static_cast<double>(e / 64) + xi[2]) / 2.0;
      const double alpha = (60.0 - 120.0 * t) * std::numbers::pi / 180.0;
      const Eigen::Vector3d x = mesh.value(mesh.reference(), {e, xi});
      EXPECT_NEAR(fibres.fibre_deg(mesh, {e, xi}), 60.0 - 120.0 * t, 1e-10);
      const Eigen::Matrix3d axes = fibres.material_axes(mesh, {e, xi});
      EXPECT_LT((axes - analytic_axes(shape, x, t, alpha)).norm(), 0.02) << "element " << e;
      EXPECT_NEAR(axes.determinant(), 1.0, 1e-12);
    }
  }
}

TEST(FibreField, SheetAngleTurnsTheSecondAxisIntoTheWall) {
  const EllipsoidShape shape;
  const HermiteMesh mesh = make_ellipsoid(shape);
  const std::vector<double> fibre_deg(mesh.node_count(), 30.0);
  const std::vector<double> sheet_deg(mesh.node_count(), 90.0);
  const MaterialPoint point{11, {0.4, 0.6, 0.5}};
  const Eigen::Matrix3d without = FibreField(fibre_deg).material_axes(mesh, point);
  const Eigen::Matrix3d with = FibreField(fibre_deg, sheet_deg).material_axes(mesh, point);
  EXPECT_LT((with.col(0) - without.col(0)).norm(), 1e-12);
  EXPECT_LT((with.col(1) - without.col(2)).norm(), 1e-12);
  EXPECT_LT((with.col(2) + without.col(1)).norm(), 1e-12);
}

}  // namespace
}  // namespace diastole
