// The Bezier form is the same cubic.

#include <gtest/gtest.h>

#include <random>

#include "estimator/mesh/bezier.hpp"

namespace diastole {
namespace {

std::array<double, 4> bernstein(double xi) {
  const double rest = 1.0 - xi;
  return {rest * rest * rest, 3 * xi * rest * rest, 3 * xi * xi * rest, xi * xi * xi};
}

Eigen::VectorXd weights_at(const Xi& xi) {
  Eigen::VectorXd weights(bezier_points);
  for (size_t i = 0; i < bezier_points; ++i)
    weights[static_cast<Eigen::Index>(i)] =
        bernstein(xi[0])[i & 3] * bernstein(xi[1])[(i >> 2) & 3] * bernstein(xi[2])[i >> 4];
  return weights;
}

TEST(Bezier, FormOfAHermiteFieldHasItsValuesEverywhere) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const ElementField field = ElementField::NullaryExpr([&] { return unit(random); });
  const BezierField control = bezier_of(field);
  for (int trial = 0; trial < 20; ++trial) {
    const Xi xi{unit(random), unit(random), unit(random)};
    const HermiteBasis basis = hermite_basis(xi);
    const Eigen::Vector3d hermite = field * Eigen::Map<const Eigen::Vector<double, 64>>(basis.value.data());
    EXPECT_LT((control * weights_at(xi) - hermite).norm(), 1e-12);
  }
}

TEST(Bezier, FormThroughSamplesIsTheCubicThatWasSampled) {
  const std::array<double, 4> at{0.07, 0.33, 0.67, 0.93};
  const auto cubic = [](const Xi& xi) {
    return 1.0 + xi[0] * xi[0] * xi[0] * xi[2] - 2.0 * xi[1] * xi[1] + xi[0] * xi[1] * xi[2] * xi[2] * xi[2];
  };
  const Eigen::MatrixXd control = bezier_through(
      at, [&](const Xi& xi) -> Eigen::VectorXd { return Eigen::VectorXd::Constant(1, cubic(xi)); });
  for (const Xi& xi : {Xi{0, 0, 0}, Xi{1, 0.5, 0.25}, Xi{0.3, 1, 1}})
    EXPECT_NEAR((control.transpose() * weights_at(xi))(0), cubic(xi), 1e-12);
}

TEST(Bezier, PointsLieWhereVtkKeepsThem) {
  // vtkHigherOrderHexahedron::PointIndexFromIJK of VTK 9.1, i fastest.
  constexpr std::array<size_t, bezier_points> vtk{
      0,  8,  9,  1,  14, 48, 49, 10, 15, 50, 51, 11, 3,  12, 13, 2,  24, 40, 41, 26, 32, 56,
      57, 36, 33, 58, 59, 37, 30, 44, 45, 28, 25, 42, 43, 27, 34, 60, 61, 38, 35, 62, 63, 39,
      31, 46, 47, 29, 4,  16, 17, 5,  22, 52, 53, 18, 23, 54, 55, 19, 7,  20, 21, 6};
  for (size_t i = 0; i < bezier_points; ++i)
    EXPECT_EQ(vtk_place_of(i & 3, (i >> 2) & 3, i >> 4), vtk[i]) << i;
}

}  // namespace
}  // namespace diastole
