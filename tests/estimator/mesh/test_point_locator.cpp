#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

/// A smooth, large, known motion: twist about z, swelling that fades with height.
NodeField bent(const HermiteMesh& mesh) {
  NodeField field = mesh.reference();
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    const double height = mesh.reference()[dof_of(node, 0, 2)];
    const double angle = 0.006 * height;
    const double swelling = 1.3 - 0.005 * std::abs(height);
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      const double x = mesh.reference()[dof_of(node, d, 0)];
      const double y = mesh.reference()[dof_of(node, d, 1)];
      field[dof_of(node, d, 0)] = swelling * (std::cos(angle) * x - std::sin(angle) * y);
      field[dof_of(node, d, 1)] = swelling * (std::sin(angle) * x + std::cos(angle) * y);
    }
  }
  return field;
}

TEST(PointLocator, FindsRandomMaterialPointsInReferenceAndDeformedConfiguration) {
  const HermiteMesh mesh = make_annulus({});
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const NodeField& field : {mesh.reference(), bent(mesh)}) {
    const PointLocator locator(mesh, field);
    for (int n = 0; n < 300; ++n) {
      const MaterialPoint point{random() % mesh.element_count(), {unit(random), unit(random), unit(random)}};
      const std::optional<LocatedPoint> found = locator.find(mesh.value(field, point));
      ASSERT_TRUE(found);
      EXPECT_EQ(found->point.element, point.element);
      EXPECT_EQ(found->overshoot_xi, 0.0);
      for (size_t k = 0; k < 3; ++k)
        EXPECT_NEAR(found->point.xi[k], point.xi[k], 1e-9);
    }
  }
}

TEST(PointLocator, UsesAGoodGuessAndSurvivesABadOne) {
  const HermiteMesh mesh = make_annulus({});
  const PointLocator locator(mesh, mesh.reference());
  const MaterialPoint point{12, {0.4, 0.6, 0.3}};
  const Eigen::Vector3d place = mesh.value(mesh.reference(), point);
  for (const MaterialPoint& guess :
       {MaterialPoint{12, {0.5, 0.5, 0.5}}, MaterialPoint{30, {0.1, 0.1, 0.1}}}) {
    const std::optional<LocatedPoint> found = locator.find(place, guess);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->point.element, 12U);
  }
}

TEST(PointLocator, ExtrapolatesSlightlyOutsideTheWallOnly) {
  const HermiteMesh mesh = make_annulus({});
  const PointLocator locator(mesh, mesh.reference());
  const std::optional<LocatedPoint> outside = locator.find({51.0, 0.0, 10.0});
  ASSERT_TRUE(outside);
  EXPECT_GT(outside->overshoot_xi, 0.01);
  EXPECT_LT(outside->overshoot_xi, 0.1);
  EXPECT_TRUE(mesh.value(mesh.reference(), outside->point).isApprox(Eigen::Vector3d(51.0, 0.0, 10.0), 1e-10));
  EXPECT_TRUE(locator.find({0.0, 21.8, 0.0}));
  EXPECT_FALSE(locator.find({90.0, 0.0, 0.0}));
  EXPECT_FALSE(locator.find({0.0, 0.0, 0.0}));
  EXPECT_FALSE(PointLocator(mesh, mesh.reference(), {.outside_xi = 0.001, .tolerance_mm = 1e-10})
                   .find({51.0, 0.0, 10.0}));
}

TEST(PointLocator, StaysInTheElementOfAGuessWhereItIsAsked) {
  const HermiteMesh mesh = make_annulus({});
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = 0.001});
  const MaterialPoint inside = locator.find({40.0, 1.0, 10.0}).value().point;
  // Beyond what `find` allows, and in a neighbour's place.
  for (const Eigen::Vector3d& place_mm :
       {Eigen::Vector3d(56.0, 1.0, 10.0), Eigen::Vector3d(28.0, 32.0, 10.0)}) {
    const std::optional<LocatedPoint> beside = locator.find_beside(place_mm, inside);
    ASSERT_TRUE(beside);
    EXPECT_EQ(beside->point.element, inside.element);
    EXPECT_GT(beside->overshoot_xi, 0.001);
    EXPECT_TRUE(mesh.value(mesh.reference(), beside->point).isApprox(place_mm, 1e-9));
  }
}

TEST(PointLocator, PrefersTheInsideAtAnElementBoundary) {
  const HermiteMesh mesh = make_annulus({});
  const PointLocator locator(mesh, mesh.reference());
  const std::optional<LocatedPoint> found = locator.find({36.0, 0.0, 0.0});  // corner edge of four elements
  ASSERT_TRUE(found);
  EXPECT_EQ(found->overshoot_xi, 0.0);
}

}  // namespace
}  // namespace diastole
