#include "estimator/fe/element_mechanics.hpp"

#include <utility>

#include "estimator/fe/gauss_contraction.hpp"

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;

Index at(size_t i) { return static_cast<Index>(i); }

/// d(det g)/dg.
Matrix3d cofactors(const Matrix3d& g) {
  Matrix3d cofactor;
  cofactor.col(0) = g.col(1).cross(g.col(2));
  cofactor.col(1) = g.col(2).cross(g.col(0));
  cofactor.col(2) = g.col(0).cross(g.col(1));
  return cofactor;
}

double pressure_at(const std::array<double, corners>& pressure, size_t q) {
  double sum = 0.0;
  for (size_t m = 0; m < corners; ++m)
    sum += pressure[m] * gauss_tables().trilinear[q][m];
  return sum;
}

/// The matrices times the tri-linear function of a corner.
GaussMatrices share_of_corner(GaussMatrices matrices, size_t corner) {
  for (auto& column : matrices.numbers) {
    for (size_t q = 0; q < gauss_points; ++q) {
      for (size_t i = 0; i < 3; ++i)
        column[3 * q + i] *= gauss_tables().trilinear[q][corner];
    }
  }
  return matrices;
}

SymmetricTensor<double> right_cauchy_green(const Matrix3d& axes) {
  return symmetric_part(axes.transpose() * axes);
}

/// Adds d2(energy)/(dg_iK dg_kL), row 3 i + K, column 3 k + L.
void add_moduli(double* moduli_at_point, const Eigen::Matrix<double, 9, 9>& part) {
  for (size_t row = 0; row < 9; ++row) {
    for (size_t column = 0; column < 9; ++column)
      moduli_at_point[modulus_index(row / 3, row % 3, column / 3, column % 3)] += part(at(row), at(column));
  }
}

/// Adds f(i, A) D(AM, BN) f(k, B) over material indices, then turns M, N into xi: the law's part of the
/// moduli.
void add_material_moduli(double* moduli_at_point, const Matrix3d& f, const TangentTensor& tangent,
                         const Matrix3d& t) {
  // strain(m; iM): derivative of the strain component m with respect to (g T)_iM, off-diagonal ones doubled.
  Eigen::Matrix<double, 6, 9> strain = Eigen::Matrix<double, 6, 9>::Zero();
  for (size_t m = 0; m < 6; ++m) {
    const auto [p, r] = symmetric_entries[m];
    for (size_t i = 0; i < 3; ++i) {
      strain(at(m), at(3 * i + p)) += f(at(i), at(r));
      if (p != r) strain(at(m), at(3 * i + r)) += f(at(i), at(p));
    }
  }
  Eigen::Matrix<double, 6, 9> in_xi;
  for (Index i = 0; i < 3; ++i)
    in_xi.middleCols<3>(3 * i) = strain.middleCols<3>(3 * i) * t.transpose();
  add_moduli(moduli_at_point, in_xi.transpose() * tangent * in_xi);
}

/// Initial-stress part delta_ik s(K, L) and pressure part -p d(cof g)_iK/dg_kL; overwrites all moduli.
void set_geometric_moduli(double* moduli_at_point, const Matrix3d& s, double pressure, const Matrix3d& g) {
  for (size_t n = 0; n < moduli; ++n)
    moduli_at_point[n] = 0.0;
  for (size_t dk = 0; dk < 3; ++dk) {
    for (size_t dl = 0; dl < 3; ++dl) {
      for (size_t i = 0; i < 3; ++i)
        moduli_at_point[modulus_index(i, dk, i, dl)] = s(at(dk), at(dl));
    }
  }
  for (size_t i = 0; i < 3; ++i) {
    const size_t j = (i + 1) % 3;
    const size_t k = (i + 2) % 3;
    for (size_t dk = 0; dk < 3; ++dk) {
      const size_t dl = (dk + 1) % 3;
      const size_t dm = (dk + 2) % 3;
      const double even = pressure * g(at(k), at(dm));
      const double odd = pressure * g(at(k), at(dl));
      moduli_at_point[modulus_index(i, dk, j, dl)] -= even;
      moduli_at_point[modulus_index(j, dl, i, dk)] -= even;
      moduli_at_point[modulus_index(i, dk, j, dm)] += odd;
      moduli_at_point[modulus_index(j, dm, i, dk)] += odd;
    }
  }
}

/// (1 - m) p0.
double rest_pressure_lacking(const ReferencePoint& reference, const ElementState& state) {
  return (1.0 - reference.stiffness) * state.rest_pressure_kPa;
}

/// p - kappa (J - 1) - (1 - m) p0: the pressure that cof(g) sees.
double effective_pressure(const ReferencePoint& reference, const ElementState& state, size_t q,
                          double volume_ratio) {
  return pressure_at(state.pressure_kPa, q) - state.volume_stiffness_kPa * (volume_ratio - 1.0) -
         rest_pressure_lacking(reference, state);
}

}  // namespace

MaterialAxesField material_axes_of(FibreField fibres) {
  return [fibres = std::move(fibres)](const HermiteMesh& mesh, const MaterialPoint& point) {
    return fibres.material_axes(mesh, point);
  };
}

ReferenceElement make_reference_element(const HermiteMesh& mesh, size_t element,
                                        const MaterialAxesField& axes, const StiffnessField& stiffness) {
  const GaussMatrices gradients = gradients_at_points(mesh.gather(element, mesh.reference()));
  ReferenceElement reference;
  for (size_t q = 0; q < gauss_points; ++q) {
    const Matrix3d g = gradients.at(q);
    reference[q].material_to_xi = g.inverse();
    if (axes) reference[q].material_to_xi *= axes(mesh, {element, gauss_tables().xi[q]});
    reference[q].volume = gauss_tables().weight[q] * g.determinant();
    if (stiffness)
      reference[q].stiffness = stiffness(mesh.value(mesh.reference(), {element, gauss_tables().xi[q]}));
  }
  return reference;
}

ElementResidual element_residual(const ReferenceElement& reference, const ElementState& state, const Law& law,
                                 std::span<const double> parameters) {
  const GaussTables& tables = gauss_tables();
  const GaussMatrices gradients = gradients_at_points(state.position_mm);
  GaussMatrices piola;
  ElementResidual result;
  result.volume_mm3.fill(0.0);
  result.least.ratio = std::numeric_limits<double>::infinity();
  for (size_t q = 0; q < gauss_points; ++q) {
    const Matrix3d g = gradients.at(q);
    const Matrix3d cofactor = cofactors(g);
    const double volume = tables.weight[q] * g.col(0).dot(cofactor.col(0));
    const double ratio = volume / reference[q].volume;
    if (ratio < result.least.ratio) result.least = {ratio, q};
    const Matrix3d& t = reference[q].material_to_xi;
    const Matrix3d f = g * t;
    const SymmetricTensor<double> c = right_cauchy_green(f);
    Matrix3d stress = reference[q].stiffness * full_matrix(law.stress(c, parameters));
    stress(0, 0) += state.fibre_tension_kPa;
    const double pressure = effective_pressure(reference[q], state, q, ratio);
    piola.set(q, reference[q].volume * f * stress * t.transpose() - (pressure * tables.weight[q]) * cofactor);
    result.energy += reference[q].volume * reference[q].stiffness * law.energy(c, parameters);
    double growth = volume - reference[q].volume;
    result.energy += rest_pressure_lacking(reference[q], state) * growth;
    if (state.compressibility_per_kPa > 0.0) {
      const double above_rest = pressure_at(state.pressure_kPa, q) - state.rest_pressure_kPa;
      const double shrinkage = reference[q].volume * state.compressibility_per_kPa * above_rest;
      result.energy += 0.5 * shrinkage * above_rest - state.rest_pressure_kPa * growth;
      growth += shrinkage;
    }
    for (size_t m = 0; m < corners; ++m)
      result.volume_mm3[m] -= growth * tables.trilinear[q][m];
  }
  result.force = force_of(piola);
  return result;
}

void element_tangent(const ReferenceElement& reference, const ElementState& state, const Law& law,
                     std::span<const double> parameters, ElementTangent& tangent) {
  const GaussTables& tables = gauss_tables();
  const GaussMatrices gradients = gradients_at_points(state.position_mm);
  GaussMatrices volume_slopes;
  tangent.compliance.setZero();
  for (size_t q = 0; q < gauss_points; ++q) {
    const Matrix3d g = gradients.at(q);
    const Matrix3d& t = reference[q].material_to_xi;
    const Matrix3d f = g * t;
    const Matrix3d cofactor = cofactors(g);
    const double weight = tables.weight[q];
    const double ratio = weight * g.col(0).dot(cofactor.col(0)) / reference[q].volume;
    const MaterialResponse response = law.response(right_cauchy_green(f), parameters);
    Matrix3d material_stress = reference[q].stiffness * full_matrix(response.stress);
    material_stress(0, 0) += state.fibre_tension_kPa;
    const double pressure = effective_pressure(reference[q], state, q, ratio) * weight;
    const Matrix3d stress = reference[q].volume * t * material_stress * t.transpose();
    double* point = tangent.stiffness.moduli_at(q);
    set_geometric_moduli(point, stress, pressure, g);
    if (!response.tangent.isZero(0.0))
      add_material_moduli(point, f, reference[q].volume * reference[q].stiffness * response.tangent, t);
    const double volume_stiffness_kPa = state.volume_stiffness_kPa + state.probing_stiffness_kPa;
    if (volume_stiffness_kPa > 0.0) {
      const Eigen::Vector<double, 9> growth = cofactor.reshaped<Eigen::RowMajor>();
      const double factor = volume_stiffness_kPa * weight * weight / reference[q].volume;
      add_moduli(point, (factor * growth) * growth.transpose());
    }
    volume_slopes.set(q, -weight * cofactor);
    if (state.compressibility_per_kPa > 0.0) {
      const Eigen::Map<const Eigen::Vector<double, corners>> psi(tables.trilinear[q].data());
      tangent.compliance -= state.compressibility_per_kPa * reference[q].volume * psi * psi.transpose();
    }
  }
  for (size_t m = 0; m < corners; ++m)
    tangent.coupling[m] = force_of(share_of_corner(volume_slopes, m));
  tangent.stiffness.contract();
}

std::array<double, corners> pressure_volume_mm3(const ReferenceElement& reference) {
  std::array<double, corners> volume{};
  for (size_t q = 0; q < gauss_points; ++q) {
    for (size_t m = 0; m < corners; ++m)
      volume[m] += reference[q].volume * gauss_tables().trilinear[q][m];
  }
  return volume;
}

std::array<Matrix3d, gauss_points> element_stiffness_forces(const ReferenceElement& reference,
                                                            const ElementField& position_mm, const Law& law,
                                                            std::span<const double> parameters) {
  const GaussMatrices gradients = gradients_at_points(position_mm);
  const double rest_pressure_kPa = law.rest_pressure_kPa(parameters);
  std::array<Matrix3d, gauss_points> forces;
  for (size_t q = 0; q < gauss_points; ++q) {
    const Matrix3d g = gradients.at(q);
    const Matrix3d& t = reference[q].material_to_xi;
    const Matrix3d f = g * t;
    forces[q] =
        reference[q].volume * f * full_matrix(law.stress(right_cauchy_green(f), parameters)) * t.transpose() -
        rest_pressure_kPa * gauss_tables().weight[q] * cofactors(g);
  }
  return forces;
}

ElementField element_parameter_force(const ReferenceElement& reference, const ElementState& state,
                                     const Law& law, std::span<const double> parameters, size_t parameter) {
  const GaussMatrices gradients = gradients_at_points(state.position_mm);
  const double rest_slope = trace(law.stress_sensitivity(undeformed, parameters, parameter)) / 3.0;  // of p0
  GaussMatrices piola;
  for (size_t q = 0; q < gauss_points; ++q) {
    const Matrix3d& t = reference[q].material_to_xi;
    const Matrix3d f = gradients.at(q) * t;
    const Matrix3d stress = full_matrix(law.stress_sensitivity(right_cauchy_green(f), parameters, parameter));
    Matrix3d force = reference[q].volume * reference[q].stiffness * f * stress * t.transpose();
    const double lacking = (1.0 - reference[q].stiffness) * rest_slope;
    if (lacking != 0.0) force += lacking * gauss_tables().weight[q] * cofactors(gradients.at(q));
    piola.set(q, force);
  }
  return force_of(piola);
}

}  // namespace diastole
