#include "estimator/fe/reference_tangent.hpp"

#include <utility>

#include "estimator/fe/gauss_contraction.hpp"

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;

/// R of  M = R^T R, upper triangular with a positive diagonal.
Matrix3d upper_factor(const Matrix3d& gram) { return gram.llt().matrixU(); }

/// U with  U^T + U = symmetric: dR R^-1 for d(R^T R) = R^T symmetric R.
Matrix3d upper_half(const Matrix3d& symmetric) {
  Matrix3d half = symmetric.triangularView<Eigen::StrictlyUpper>();
  half.diagonal() = 0.5 * symmetric.diagonal();
  return half;
}

/// d2W/dC dC : change, times two: the change of the second Piola-Kirchhoff stress.
Matrix3d stress_change(const TangentTensor& tangent, const Matrix3d& change) {
  const SymmetricTensor<double> six = symmetric_part(change);
  Eigen::Vector<double, 6> strain;
  for (Index n = 0; n < 6; ++n)
    strain[n] = six[static_cast<size_t>(n)] * (n < 3 ? 0.5 : 1.0);
  const Eigen::Vector<double, 6> stress = tangent * strain;
  SymmetricTensor<double> result;
  std::copy(stress.begin(), stress.end(), result.begin());
  return full_matrix(result);
}

/// What a Gauss point contributes.
struct PointTangent {
  Eigen::Matrix<double, 9, 9> force;  ///< row 3 K + i, column 3 L + j
  Eigen::Vector<double, 9> volume;    ///< of w det G (1 - (p - p0)/K)
};

struct PointState {
  Matrix3d reference, current, imaged;  ///< gradients by xi
  MaterialAxes imaged_axes;
  double weight, pressure_kPa;
};

PointTangent point_tangent(const PointState& at, const ElementState& state, const Law& law,
                           std::span<const double> parameters) {
  const Matrix3d to_reference = at.reference * at.imaged.inverse();
  const Matrix3d fibres = to_reference * at.imaged_axes;
  const Matrix3d factor = upper_factor(fibres.transpose() * fibres);
  const Matrix3d unfactor = factor.inverse();
  const Matrix3d t = at.imaged.inverse() * at.imaged_axes * unfactor;
  const Matrix3d f = at.current * t;
  const Matrix3d c = f.transpose() * f;
  const MaterialResponse response = law.response(symmetric_part(c), parameters);
  const Matrix3d stress = full_matrix(response.stress);
  const double volume = at.weight * at.reference.determinant();
  const double ratio = at.current.determinant() / at.reference.determinant();
  const Matrix3d inverse = at.reference.inverse();
  const Matrix3d cofactor = at.current.determinant() * at.current.inverse().transpose();
  const Matrix3d piola = volume * f * stress * t.transpose();
  PointTangent tangent;
  for (Index direction = 0; direction < 3; ++direction) {
    for (Index component = 0; component < 3; ++component) {
      const double growth = inverse(direction, component);  // of det G, relative
      const Matrix3d moved =
          Eigen::Vector3d::Unit(component) * (at.imaged.inverse().row(direction) * at.imaged_axes);
      const Matrix3d gram = moved.transpose() * fibres;
      const Matrix3d u = upper_half(unfactor.transpose() * (gram + gram.transpose()) * unfactor);
      const Matrix3d dc = -(u.transpose() * c + c * u);
      const Matrix3d change = growth * piola -
                              volume * f * (u * stress + stress * u.transpose()) * t.transpose() +
                              volume * f * stress_change(response.tangent, dc) * t.transpose() -
                              (state.volume_stiffness_kPa * ratio * growth * at.weight) * cofactor;
      const Index column = 3 * direction + component;
      tangent.force.col(column) = change.reshaped();
      tangent.volume[column] =
          (1.0 - state.compressibility_per_kPa * (at.pressure_kPa - state.rest_pressure_kPa)) * volume *
          growth;
    }
  }
  return tangent;
}

using Slopes = Eigen::Matrix<double, static_cast<int>(hermite_functions), Eigen::Dynamic>;

/// dN_a/dxi_L at point q: row a, column 3 q + L.
const Slopes& slopes() {
  static const Slopes table = [] {
    Slopes made(hermite_functions, 3 * gauss_points);
    for (size_t q = 0; q < gauss_points; ++q)
      for (size_t k = 0; k < 3; ++k)
        for (size_t a = 0; a < hermite_functions; ++a)
          made(static_cast<Index>(a), static_cast<Index>(3 * q + k)) = gauss_tables().slope[q][k][a];
    return made;
  }();
  return table;
}

/// force(3 a + i, 3 b + j) = sum over q, K, L of dN_a/dxi_K A(q; iK, jL) dN_b/dxi_L, one pair i, j at a time.
void contract(const std::array<PointTangent, gauss_points>& points, ReferenceTangent& tangent) {
  Slopes weighted(hermite_functions, 3 * gauss_points);
  tangent.force.resize(3 * hermite_functions, 3 * hermite_functions);
  for (Index i = 0; i < 3; ++i) {
    for (Index j = 0; j < 3; ++j) {
      for (Index q = 0; q < static_cast<Index>(gauss_points); ++q) {
        Matrix3d moduli;
        for (Index k = 0; k < 3; ++k)
          for (Index l = 0; l < 3; ++l)
            moduli(k, l) = points[static_cast<size_t>(q)].force(3 * k + i, 3 * l + j);
        weighted.middleCols<3>(3 * q).noalias() = slopes().middleCols<3>(3 * q) * moduli;
      }
      tangent.force(Eigen::seqN(i, hermite_functions, 3), Eigen::seqN(j, hermite_functions, 3)) =
          weighted * slopes().transpose();
    }
  }
  tangent.volume.setZero();
  for (Index q = 0; q < static_cast<Index>(gauss_points); ++q) {
    const PointTangent& point = points[static_cast<size_t>(q)];
    const Eigen::Map<const Eigen::Vector<double, corners>> psi(
        gauss_tables().trilinear[static_cast<size_t>(q)].data());
    for (Index j = 0; j < 3; ++j) {
      const Eigen::Vector3d by_direction(point.volume[j], point.volume[3 + j], point.volume[6 + j]);
      const Eigen::VectorXd by_function = slopes().middleCols<3>(3 * q) * by_direction;
      tangent.volume(Eigen::all, Eigen::seqN(j, hermite_functions, 3)) += psi * by_function.transpose();
    }
  }
}

}  // namespace

MaterialAxes carried_back(const Matrix3d& reference_gradient, const Matrix3d& imaged_gradient,
                          const MaterialAxes& imaged_axes) {
  const Matrix3d fibres = reference_gradient * imaged_gradient.inverse() * imaged_axes;
  return fibres * upper_factor(fibres.transpose() * fibres).inverse();
}

MaterialAxesField carried_back(const HermiteMesh& imaged, MaterialAxesField axes) {
  if (!axes) return {};
  return [imaged, axes = std::move(axes)](const HermiteMesh& mesh, const MaterialPoint& point) {
    return carried_back(mesh.xi_gradient(mesh.reference(), point),
                        imaged.xi_gradient(imaged.reference(), point), axes(imaged, point));
  };
}

void reference_tangent(const HermiteMesh& imaged, size_t element, const ElementField& reference_mm,
                       const MaterialAxesField& imaged_axes, const ElementState& state, const Law& law,
                       std::span<const double> parameters, ReferenceTangent& tangent) {
  const GaussMatrices reference = gradients_at_points(reference_mm);
  const GaussMatrices current = gradients_at_points(state.position_mm);
  const GaussMatrices as_imaged = gradients_at_points(imaged.gather(element, imaged.reference()));
  std::array<PointTangent, gauss_points> points;
  for (size_t q = 0; q < gauss_points; ++q) {
    double pressure_kPa = 0.0;
    for (size_t m = 0; m < corners; ++m)
      pressure_kPa += state.pressure_kPa[m] * gauss_tables().trilinear[q][m];
    const MaterialAxes axes =
        imaged_axes ? imaged_axes(imaged, {element, gauss_tables().xi[q]}) : MaterialAxes::Identity();
    points[q] = point_tangent(
        {reference.at(q), current.at(q), as_imaged.at(q), axes, gauss_tables().weight[q], pressure_kPa},
        state, law, parameters);
  }
  contract(points, tangent);
}

}  // namespace diastole
