#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/mesh/hermite_basis.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {
namespace {

TEST(HermiteBasis, InterpolatesValueAndSlopeAtTheEnds) {
  for (const double end : {0.0, 1.0}) {
    const size_t offset = end == 0.0 ? 0 : 2;
    for (size_t a = 0; a < 4; ++a) {
      EXPECT_DOUBLE_EQ(hermite_values(end)[a], a == offset ? 1.0 : 0.0);
      EXPECT_DOUBLE_EQ(hermite_slopes(end)[a], a == offset + 1 ? 1.0 : 0.0);
    }
  }
}

TEST(HermiteBasis, NumbersFunctionsByCornerAndDerivative) {
  for (size_t a = 0; a < hermite_functions; ++a) {
    EXPECT_EQ(hermite_function(hermite_corner(a), hermite_derivative(a)), a);
  }
  EXPECT_EQ(hermite_function(7, 7), 63U);
  EXPECT_EQ(hermite_function(1, 0), 2U);
  EXPECT_EQ(hermite_function(0, 4), 16U);
}

TEST(HermiteBasis, SlopesAreDerivativesOfTheValues) {
  const Xi place{0.3, -0.1, 0.8};
  constexpr double step = 1e-6;
  const HermiteBasis basis = hermite_basis(place);
  for (size_t k = 0; k < 3; ++k) {
    Xi before = place;
    Xi after = place;
    before[k] -= step;
    after[k] += step;
    const HermiteBasis low = hermite_basis(before);
    const HermiteBasis high = hermite_basis(after);
    for (size_t a = 0; a < hermite_functions; ++a) {
      EXPECT_NEAR(basis.slope[k][a], (high.value[a] - low.value[a]) / (2.0 * step), 1e-8);
    }
  }
}

/// The cube 0..2 x 0..3 x 0..4 as one element whose nodal derivatives are stored per mm: scale factors are
/// the edges.
HermiteMesh block_with_scale_factors() {
  const std::array<double, 3> edge{2.0, 3.0, 4.0};
  NodeField field(corners * dofs_per_node, 0.0);
  HermiteMesh::Scales scales;
  for (size_t c = 0; c < corners; ++c) {
    for (size_t k = 0; k < 3; ++k) {
      field[dof_of(c, 0, k)] = ((c >> k) & 1) != 0 ? edge[k] : 0.0;
      field[dof_of(c, size_t{1} << k, k)] = 1.0;
    }
  }
  for (size_t a = 0; a < hermite_functions; ++a) {
    scales[a] = 1.0;
    for (size_t k = 0; k < 3; ++k)
      scales[a] *= ((hermite_derivative(a) >> k) & 1) != 0 ? edge[k] : 1.0;
  }
  return HermiteMesh(field, {{0, 1, 2, 3, 4, 5, 6, 7}}, {}, {scales});
}

TEST(HermiteMesh, ScaleFactorsTurnSlopesPerMillimetreIntoSlopesPerXi) {
  const HermiteMesh mesh = block_with_scale_factors();
  const MaterialPoint point{0, {0.25, 0.5, 0.75}};
  EXPECT_TRUE(mesh.value(mesh.reference(), point).isApprox(Eigen::Vector3d(0.5, 1.5, 3.0), 1e-14));
  EXPECT_TRUE(mesh.xi_gradient(mesh.reference(), point)
                  .isApprox(Eigen::Vector3d(2.0, 3.0, 4.0).asDiagonal().toDenseMatrix(), 1e-14));
  EXPECT_DOUBLE_EQ(mesh.extent_mm(), 4.0);
}

TEST(HermiteMesh, ReferenceGradientOfAnAffineMotionIsItsMatrix) {
  const HermiteMesh mesh = block_with_scale_factors();
  Eigen::Matrix3d f;
  f << 1.1, 0.2, 0.0, -0.1, 0.9, 0.3, 0.0, 0.1, 1.2;
  NodeField moved(mesh.reference().size());
  for (size_t start = 0; start < moved.size(); start += 3) {
    const Eigen::Vector3d image = f * Eigen::Vector3d(&mesh.reference()[start]);
    std::copy_n(image.data(), 3, &moved[start]);
  }
  EXPECT_TRUE(mesh.reference_gradient(moved, {0, {0.2, 0.9, 0.4}}).isApprox(f, 1e-13));
}

TEST(HermiteMesh, FaceCornersLieOnTheFace) {
  const std::array<size_t, 4> inner = face_corners({0, 2, 0});
  EXPECT_EQ(inner, (std::array<size_t, 4>{0, 1, 2, 3}));
  const std::array<size_t, 4> top = face_corners({0, 1, 1});
  EXPECT_EQ(top, (std::array<size_t, 4>{2, 3, 6, 7}));
}

}  // namespace
}  // namespace diastole
