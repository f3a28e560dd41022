#include <gtest/gtest.h>

#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/reconstruction/cross_validation.hpp"
#include "tests/estimator/reconstruction/tagged_motion.hpp"

namespace diastole {
namespace {

/// u = A X as a field: the nodal numbers of the reference, turned and stretched.
NodeField affine(const HermiteMesh& mesh, const Eigen::Matrix3d& A) {
  NodeField field(mesh.reference().size());
  for (size_t dof = 0; dof < field.size(); dof += 3) {
    const Eigen::Vector3d moved = A * Eigen::Map<const Eigen::Vector3d>(&mesh.reference()[dof]);
    std::copy(moved.begin(), moved.end(), field.begin() + static_cast<std::ptrdiff_t>(dof));
  }
  return field;
}

TEST(Sobolev, AnAffineMotionCostsItsGradientOnly) {
  const HermiteMesh mesh = test::small_gel();
  Eigen::Matrix3d A;
  A << 0.1, 0.2, -0.1, 0.0, -0.1, 0.3, 0.05, 0.0, 0.02;
  for (const SobolevWeights& weights :
       {SobolevWeights{1.0, 0.0, 10.0}, SobolevWeights{0.0, 1.0, 10.0}, SobolevWeights{0.5, 2.0, 7.0}}) {
    const FieldForms forms(mesh, weights);
    const Eigen::VectorXd q = forms.space.unknowns_of(affine(mesh, A));
    EXPECT_NEAR(forms.quadratic.apply(forms.sobolev.smoothness, q), weights.first * A.squaredNorm(), 1e-9);
  }
}

TEST(Sobolev, SecondDerivativesAreThoseOfSpace) {
  // u = z² e_x on a body whose height is linear in xi: second derivative 2 everywhere.
  const HermiteMesh mesh = make_annulus({.elements = {4, 2, 1}, .plate_grading = 0.0});
  NodeField field(mesh.reference().size(), 0.0);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    const auto z = [&](size_t derivative) { return mesh.reference()[dof_of(node, derivative, 2)]; };
    field[dof_of(node, 0, 0)] = z(0) * z(0);
    field[dof_of(node, 2, 0)] = 2.0 * z(0) * z(2);
  }
  const FieldForms forms(mesh, {0.0, 1.0, 10.0});
  const double expected = 4.0 * 10.0 * 10.0;
  EXPECT_NEAR(forms.quadratic.apply(forms.sobolev.smoothness, forms.space.unknowns_of(field)), expected,
              1e-6 * expected);
}

TEST(Sobolev, CollapsedEdgesCountWhatTheyShare) {
  const HermiteMesh mesh = make_ellipsoid({.elements = {4, 2, 1}});
  const FieldForms forms(mesh, {1.0, 0.0, 10.0});
  const Eigen::Matrix3d A = Eigen::Vector3d(0.1, -0.2, 0.3).asDiagonal();
  const NodeField field = affine(mesh, A);
  const Eigen::VectorXd q = forms.space.unknowns_of(field);
  EXPECT_LT(forms.space.unknowns(), static_cast<Eigen::Index>(mesh.node_count() * dofs_per_node));
  const NodeField back = forms.space.field_of(q);
  for (size_t dof = 0; dof < field.size(); ++dof)
    ASSERT_NEAR(back[dof], field[dof], 1e-12);
  EXPECT_NEAR(forms.quadratic.apply(forms.sobolev.smoothness, q), A.squaredNorm(), 1e-9);
}

TEST(CrossValidation, RandomSignsFindTheTrace) {
  const HermiteMesh mesh = test::small_gel();
  const Measurement measurement = test::tagged_inflation(mesh, 5.0, {.tags_a_frame = 300});
  const FieldForms forms(mesh, {});
  SmoothedSystem system(forms);
  std::vector<ObservationRow> rows;
  const PointLocator locator(mesh, mesh.reference());
  for (const TagPoint& tag : measurement.tags) {
    const Eigen::Vector3d n(tag.normal.data()), x(tag.x_mm.data());
    if (const auto found = locator.find(x))
      rows.push_back({displacement_along(mesh, found->point, n), n.dot(x) - tag.plane_mm, tag.sigma_mm, 1.0});
  }
  system.set_rows(rows);
  const Eigen::MatrixXd seen = Eigen::MatrixXd(system.weighted_rows()).transpose();
  for (const double lambda : {1e2, 1e5}) {
    system.factorise(lambda);
    const double exact = seen.cwiseProduct(system.solve(seen)).sum();
    EXPECT_GT(exact, 3.0);
    EXPECT_LT(exact, static_cast<double>(rows.size()));
    // The estimate's own spread is sqrt(2 tr K / 24).
    EXPECT_NEAR(stochastic_trace(system, seen_signs(system)), exact, 4.0 * std::sqrt(2.0 * exact / 24.0));
  }
}

}  // namespace
}  // namespace diastole
