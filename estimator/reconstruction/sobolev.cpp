#include "estimator/reconstruction/sobolev.hpp"

#include "estimator/fe/gauss_points.hpp"

namespace diastole {
namespace {

using ScalarMatrix =
    Eigen::Matrix<double, static_cast<int>(hermite_functions), static_cast<int>(hermite_functions)>;
using Derivatives = Eigen::Matrix<double, static_cast<int>(hermite_functions), Eigen::Dynamic>;

constexpr std::array<std::array<size_t, 2>, 6> second_orders{
    {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {1, 2}, {0, 2}}};

/// Second derivatives by xi of the 64 functions, a column for each pair of `second_orders`.
Derivatives xi_curvatures(const Xi& xi) {
  std::array<std::array<std::array<double, 4>, 3>, 3> line;  // [direction][order][function]
  for (size_t k = 0; k < 3; ++k)
    line[k] = {hermite_values(xi[k]), hermite_slopes(xi[k]), hermite_curvatures(xi[k])};
  Derivatives result(hermite_functions, second_orders.size());
  for (size_t a = 0; a < hermite_functions; ++a) {
    const std::array<size_t, 3> function{a & 3, (a >> 2) & 3, a >> 4};
    for (size_t pair = 0; pair < second_orders.size(); ++pair) {
      std::array<size_t, 3> order{0, 0, 0};
      for (const size_t k : second_orders[pair])
        ++order[k];
      double product = 1.0;
      for (size_t k = 0; k < 3; ++k)
        product *= line[k][order[k]][function[k]];
      result(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(pair)) = product;
    }
  }
  return result;
}

/// What one Gauss point knows of the 64 functions of an element (scale factors applied).
struct SpatialBasis {
  Eigen::Matrix<double, static_cast<int>(hermite_functions), 1> value;
  Derivatives gradient;  ///< by X, 3 columns
  Derivatives hessian;   ///< by X, the 9 pairs
  double determinant;    ///< |dX/dxi|
};

SpatialBasis spatial_basis(const HermiteMesh& mesh, size_t element, const Xi& xi) {
  const HermiteBasis basis = hermite_basis(xi);
  const ElementField geometry = mesh.gather(element, mesh.reference());
  Derivatives slope(hermite_functions, 3);
  for (size_t k = 0; k < 3; ++k) {
    slope.col(static_cast<Eigen::Index>(k)) =
        Eigen::Map<const Eigen::Vector<double, 64>>(basis.slope[k].data());
  }
  const Derivatives curvature = xi_curvatures(xi);
  const Eigen::Matrix3d dX = geometry * slope;
  const Eigen::Matrix3d to_reference = dX.inverse();  // dxi/dX

  SpatialBasis result;
  result.value = Eigen::Map<const Eigen::Vector<double, 64>>(basis.value.data());
  result.gradient = slope * to_reference;
  result.determinant = std::abs(dX.determinant());
  // N,XX = dxi/dXᵀ (N,xixi - N,X · X,xixi) dxi/dX
  const Derivatives bare = curvature - result.gradient * (geometry * curvature);
  result.hessian.resize(hermite_functions, 9);
  for (Eigen::Index a = 0; a < static_cast<Eigen::Index>(hermite_functions); ++a) {
    Eigen::Matrix3d by_xi;
    for (size_t pair = 0; pair < second_orders.size(); ++pair) {
      const auto row = static_cast<Eigen::Index>(second_orders[pair][0]);
      const auto column = static_cast<Eigen::Index>(second_orders[pair][1]);
      by_xi(row, column) = by_xi(column, row) = bare(a, static_cast<Eigen::Index>(pair));
    }
    const Eigen::Matrix3d by_X = to_reference.transpose() * by_xi * to_reference;
    result.hessian.row(a) = Eigen::Map<const Eigen::RowVector<double, 9>>(by_X.data());
  }
  for (Eigen::Index a = 0; a < static_cast<Eigen::Index>(hermite_functions); ++a) {
    const double scale = mesh.scale(element, static_cast<size_t>(a));
    result.value[a] *= scale;
    result.gradient.row(a) *= scale;
    result.hessian.row(a) *= scale;
  }
  return result;
}

/// The same scalar matrix for each of the three components.
ElementMatrix for_components(const ScalarMatrix& scalar) {
  ElementMatrix matrix = ElementMatrix::Zero(element_coefficients, element_coefficients);
  for (Eigen::Index row = 0; row < scalar.rows(); ++row) {
    for (Eigen::Index column = 0; column < scalar.cols(); ++column) {
      for (Eigen::Index i = 0; i < 3; ++i)
        matrix(3 * row + i, 3 * column + i) = scalar(row, column);
    }
  }
  return matrix;
}

}  // namespace

SobolevForms sobolev_forms(const FieldSpace& space, const QuadraticForms& forms,
                           const SobolevWeights& weights) {
  const GaussTables& tables = gauss_tables();
  SobolevForms result{forms.zero(), forms.zero(), {}, 0.0};
  const double second = weights.second * weights.length_mm * weights.length_mm;
  for (size_t e = 0; e < space.mesh().element_count(); ++e) {
    ScalarMatrix smoothness = ScalarMatrix::Zero(), mean_square = ScalarMatrix::Zero();
    double volume_mm3 = 0.0;
    for (size_t q = 0; q < gauss_points; ++q) {
      const SpatialBasis basis = spatial_basis(space.mesh(), e, tables.xi[q]);
      const double part_mm3 = tables.weight[q] * basis.determinant;
      volume_mm3 += part_mm3;
      mean_square.noalias() += part_mm3 * basis.value * basis.value.transpose();
      smoothness.noalias() += part_mm3 * weights.first * basis.gradient * basis.gradient.transpose();
      smoothness.noalias() += part_mm3 * second * basis.hessian * basis.hessian.transpose();
    }
    forms.add(result.smoothness, e, for_components(smoothness));
    forms.add(result.mean_square, e, for_components(mean_square));
    result.element_volume_mm3.push_back(volume_mm3);
    result.volume_mm3 += volume_mm3;
  }
  for (double& value : result.smoothness)
    value /= result.volume_mm3;
  for (double& value : result.mean_square)
    value /= result.volume_mm3;
  return result;
}

}  // namespace diastole
