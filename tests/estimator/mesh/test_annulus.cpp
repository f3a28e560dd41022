#include <gtest/gtest.h>

#include <numbers>

#include "estimator/mesh/annulus.hpp"

namespace diastole {
namespace {

AnnulusShape shape_of(std::array<size_t, 3> elements, double plate_grading = 0.75,
                      double wall_grading = 0.5) {
  AnnulusShape shape;
  shape.elements = elements;
  shape.plate_grading = plate_grading;
  shape.wall_grading = wall_grading;
  return shape;
}

double radius_at(const HermiteMesh& mesh, size_t element, const Xi& xi) {
  return mesh.value(mesh.reference(), {element, xi}).head<2>().norm();
}

TEST(Annulus, CirclesAreRoundToFourMillionths) {
  const HermiteMesh mesh = make_annulus(shape_of({8, 4, 1}));
  for (const double xi : {0.1, 0.2, 0.25, 0.5, 0.7, 0.9}) {
    EXPECT_NEAR(radius_at(mesh, 3, {xi, 0.4, 0.0}), 22.5, 22.5 * 4.5e-6);
    EXPECT_NEAR(radius_at(mesh, 9, {xi, 0.4, 1.0}), 50.0, 50.0 * 4.5e-6);
  }
}

TEST(Annulus, NodesRunAroundThenUpThenOutwards) {
  const HermiteMesh mesh = make_annulus(shape_of({8, 4, 2}));
  EXPECT_EQ(mesh.node_count(), 8U * 5 * 3);
  EXPECT_EQ(mesh.element_count(), 8U * 4 * 2);
  EXPECT_EQ(mesh.element(7), (HermiteMesh::Corners{7, 0, 15, 8, 47, 40, 55, 48}));
  const Eigen::Vector3d first = mesh.value(mesh.reference(), {0, {0.0, 0.0, 0.0}});
  EXPECT_TRUE(first.isApprox(Eigen::Vector3d(22.5, 0.0, -42.5), 1e-12));
  const Eigen::Vector3d last = mesh.value(mesh.reference(), {63, {1.0, 1.0, 1.0}});
  EXPECT_TRUE(last.isApprox(Eigen::Vector3d(50.0, 0.0, 42.5), 1e-12));
}

TEST(Annulus, FacesCoverTheSurface) {
  const HermiteMesh mesh = make_annulus(shape_of({8, 4, 2}));
  EXPECT_EQ(mesh.faces().inner.size(), 32U);
  EXPECT_EQ(mesh.faces().outer.size(), 32U);
  EXPECT_EQ(mesh.faces().bottom.size(), 16U);
  EXPECT_EQ(mesh.faces().top.size(), 16U);
  for (const ElementFace& face : mesh.faces().outer) {
    EXPECT_NEAR(radius_at(mesh, face.element, {0.0, 0.5, 1.0}), 50.0, 1e-10);
  }
}

TEST(Annulus, PositionAndSlopesAreContinuousAcrossElements) {
  const HermiteMesh mesh = make_annulus(shape_of({6, 3, 2}));
  const auto same = [&](const MaterialPoint& one, const MaterialPoint& other) {
    EXPECT_TRUE(mesh.value(mesh.reference(), one).isApprox(mesh.value(mesh.reference(), other), 1e-12));
    EXPECT_TRUE(
        mesh.xi_gradient(mesh.reference(), one).isApprox(mesh.xi_gradient(mesh.reference(), other), 1e-12));
  };
  same({5, {1.0, 0.3, 0.6}}, {0, {0.0, 0.3, 0.6}});   // around, through the closing seam
  same({0, {0.2, 1.0, 0.6}}, {6, {0.2, 0.0, 0.6}});   // upwards
  same({0, {0.2, 0.3, 1.0}}, {18, {0.2, 0.3, 0.0}});  // outwards
}

TEST(Annulus, VolumeIsThatOfTheCylinderWhateverTheGrading) {
  for (const double plate : {0.0, 0.75}) {
    for (const double wall : {0.0, 0.5, 1.0}) {
      const HermiteMesh mesh = make_annulus(shape_of({8, 4, 2}, plate, wall));
      double volume = 0.0;
      constexpr size_t samples = 6;
      for (size_t e = 0; e < mesh.element_count(); ++e) {
        for (size_t n = 0; n < samples * samples * samples; ++n) {
          const auto place = [](size_t i) { return (static_cast<double>(i) + 0.5) / samples; };
          const Xi xi{place(n % samples), place(n / samples % samples), place(n / samples / samples)};
          const double density = mesh.xi_gradient(mesh.reference(), {e, xi}).determinant();
          EXPECT_GT(density, 0.0);
          volume += density / (samples * samples * samples);
        }
      }
      const double exact = std::numbers::pi * (50.0 * 50.0 - 22.5 * 22.5) * 85.0;
      EXPECT_NEAR(volume, exact, 2e-3 * exact);  // midpoint rule
    }
  }
}

TEST(Annulus, GradingShrinksElementsTowardsPlatesAndCavity) {
  const HermiteMesh uniform = make_annulus(shape_of({8, 4, 2}, 0.0, 0.0));
  const HermiteMesh graded = make_annulus(shape_of({8, 4, 2}));
  const auto height = [](const HermiteMesh& mesh, size_t e) {
    return mesh.value(mesh.reference(), {e, {0, 1, 0}})[2] - mesh.value(mesh.reference(), {e, {0, 0, 0}})[2];
  };
  EXPECT_NEAR(height(uniform, 0), 85.0 / 4.0, 1e-10);
  EXPECT_LT(height(graded, 0), 0.8 * height(graded, 8));
  EXPECT_LT(radius_at(graded, 0, {0, 0, 1}), radius_at(uniform, 0, {0, 0, 1}));
}

}  // namespace
}  // namespace diastole
