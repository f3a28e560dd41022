// Fibre directions at points back to nodal angles of a ventricle.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/fibres_through_points.hpp"
#include "estimator/mesh/nodal_lines.hpp"
#include "estimator/mesh/placed_mesh.hpp"

namespace diastole {
namespace {

const EllipsoidShape shape{.elements = {8, 4, 2}};

std::vector<FibrePoint> points_of(const HermiteMesh& mesh, const FibreField& fibres) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> in(0.05, 0.95);
  std::bernoulli_distribution reversed;
  std::vector<FibrePoint> points;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (int i = 0; i < 20; ++i) {
      const MaterialPoint point{e, {in(engine), in(engine), in(engine)}};
      const Eigen::Vector3d f = fibres.material_axes(mesh, point).col(0);
      points.push_back(
          {mesh.value(mesh.reference(), point), reversed(engine) ? Eigen::Vector3d(-f) : f, 0.01});
    }
  }
  return points;
}

TEST(FibresThroughPoints, FindsTheFieldWhateverTheSigns) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  const std::vector<double> transverse(mesh.node_count(), 7.0);
  const FibreField truth(ellipsoid_fibres(shape, 80, -70).nodal_fibre_deg(), {}, transverse);
  const FibresThroughPoints found = fibres_through_points(mesh, points_of(mesh, truth));
  EXPECT_EQ(found.used, 20 * mesh.element_count());
  EXPECT_LT(found.rms_deg, 1e-3);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    EXPECT_NEAR(found.fibres.nodal_fibre_deg()[node], truth.nodal_fibre_deg()[node], 0.01) << node;
    EXPECT_NEAR(found.fibres.nodal_transverse_deg()[node], 7.0, 0.01) << node;
  }
}

TEST(FibresThroughPoints, HolesAreFilledSmoothly) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  const FibreField truth = ellipsoid_fibres(shape, 60, -60);
  std::vector<FibrePoint> points = points_of(mesh, truth);
  std::erase_if(points,
                [](const FibrePoint& point) { return point.place_mm.x() > 0 && point.place_mm.y() > 0; });
  const FibresThroughPoints found = fibres_through_points(mesh, points);
  for (size_t node = 0; node < mesh.node_count(); ++node)
    EXPECT_NEAR(found.fibres.nodal_fibre_deg()[node], truth.nodal_fibre_deg()[node], 0.5) << node;
}

TEST(FibresThroughPoints, RefusesPointsElsewhere) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  const std::vector<FibrePoint> points(20, {{500, 0, 0}, {1, 0, 0}, 1.0});
  EXPECT_THROW((void)fibres_through_points(mesh, points), std::invalid_argument);
  // Another's points, of which some happen to lie within it.
  std::vector<FibrePoint> moved = points_of(mesh, ellipsoid_fibres(shape, 60, -60));
  for (FibrePoint& point : moved)
    point.place_mm.x() += 45;
  EXPECT_THROW((void)fibres_through_points(mesh, moved), std::invalid_argument);
}

TEST(FibreField, TransverseFibresLeaveTheWall) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  const MaterialPoint point{3, {0.4, 0.6, 0.3}};
  const std::vector<double> helix(mesh.node_count(), 30.0), transverse(mesh.node_count(), 20.0);
  const Eigen::Matrix3d wall = wall_axes(mesh, point);
  const Eigen::Matrix3d axes = FibreField(helix, {}, transverse).material_axes(mesh, point);
  EXPECT_NEAR(axes.col(0).dot(wall.col(2)), std::sin(20 * M_PI / 180), 1e-12);
  EXPECT_NEAR(axes.col(1).dot(wall.col(2)), 0, 1e-12);
  EXPECT_NEAR(axes.determinant(), 1, 1e-12);
}

TEST(NodalLines, DepthsAndRows) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  const NodalLines lines(mesh);
  const std::vector<double> depths = lines.depths();
  const size_t layer = mesh.node_count() / 3;
  EXPECT_EQ(depths[5], 0.0);
  EXPECT_EQ(depths[layer + 5], 0.5);
  EXPECT_EQ(depths[2 * layer + 5], 1.0);
  EXPECT_EQ(lines.after(5, 2), layer + 5);
  EXPECT_FALSE(lines.before(5, 2));
  // Around: every node; up: all but the ends; through: the middle layer.
  size_t counts[3] = {};
  for (const auto& difference : lines.second_differences())
    ++counts[difference.direction];
  EXPECT_EQ(counts[0], mesh.node_count());
  EXPECT_EQ(counts[1], mesh.node_count() / 5 * 3);
  EXPECT_EQ(counts[2], layer);
}

TEST(PlacedMesh, GoesThereAndBack) {
  const HermiteMesh mesh = make_ellipsoid(shape);
  const Placement placement{Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 2).normalized()).toRotationMatrix(),
                            {3, -4, 5}};
  const HermiteMesh there = placed(mesh, placement);
  const MaterialPoint point{7, {0.3, 0.8, 0.6}};
  const Eigen::Vector3d here = mesh.value(mesh.reference(), point);
  const Eigen::Vector3d moved = there.value(there.reference(), point);
  EXPECT_LT((moved - placement(here)).norm(), 1e-10);
  EXPECT_LT((placement.back(moved) - here).norm(), 1e-10);
  EXPECT_LT((wall_axes(there, point) - placement.rotation * wall_axes(mesh, point)).norm(), 1e-10);
}

}  // namespace
}  // namespace diastole
