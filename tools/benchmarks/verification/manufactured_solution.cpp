#include "tools/benchmarks/verification/manufactured_solution.hpp"

#include <array>
#include <cmath>
#include <utility>

#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/point_fields.hpp"
#include "estimator/mesh/block.hpp"
#include "tools/benchmarks/verification/mixed_derivatives.hpp"

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

std::array<Mixed, 3> deformed(const std::array<Mixed, 3>& reference) {
  const auto& [big_x, big_y, big_z] = reference;
  const Mixed x = big_x + 0.12 * sin(2.0 * big_y + big_z);
  const Mixed y = big_y + 0.1 * sin(2.0 * x + -1.0 * big_z);
  const Mixed z = big_z + 0.1 * sin(x + 2.0 * y);
  return {x, y, z};
}

std::array<Mixed, 3> deformed(const Vector3d& at) {
  return deformed({Mixed::variable(at[0], 0), Mixed::variable(at[1], 1), Mixed::variable(at[2], 2)});
}

Matrix3d deformation_gradient(const Vector3d& reference) {
  const std::array<Mixed, 3> x = deformed(reference);
  Matrix3d f;
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k)
      f(static_cast<Index>(i), static_cast<Index>(k)) = x[i].part[size_t{1} << k];
  }
  return f;
}

double exact_pressure_kPa(const ManufacturedCase& made_up, const Vector3d& at) {
  constexpr SymmetricTensor<double> rest{1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
  const double at_rest = trace(made_up.law->stress(rest, made_up.parameters)) / 3.0;
  const double plane = at_rest - 1.0 + 0.5 * at[0] - 0.7 * at[1] + 0.3 * at[0] * at[2];
  return plane + made_up.pressure_wave_kPa * std::sin(2.0 * at[0] + at[1] - 3.0 * at[2]);
}

Matrix3d material_axes(const ManufacturedCase& made_up, const Vector3d& at) {
  const double most = made_up.fibres_turn ? std::acos(-1.0) / 3.0 : 0.0;
  return Eigen::AngleAxisd(most * (1.0 - 2.0 * at[2]), Vector3d::UnitZ()).toRotationMatrix();
}

/// First Piola-Kirchhoff stress.
Matrix3d exact_stress_kPa(const ManufacturedCase& made_up, const Vector3d& at) {
  const Matrix3d f = deformation_gradient(at);
  const Matrix3d axes = material_axes(made_up, at);
  const Matrix3d in_axes = f * axes;
  const Matrix3d s =
      full_matrix(made_up.law->stress(symmetric_part(in_axes.transpose() * in_axes), made_up.parameters));
  return f * axes * s * axes.transpose() -
         exact_pressure_kPa(made_up, at) * f.determinant() * f.inverse().transpose();
}

/// Visits the 5x5x5 Gauss points of every element: visit(point, reference place, volume weight).
template <class Visit>
void for_each_point(const HermiteMesh& mesh, const Visit& visit) {
  const LineRule<5> rule = line_rule_5();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t q = 0; q < 125; ++q) {
      const std::array<size_t, 3> index{q % 5, q / 5 % 5, q / 25};
      MaterialPoint point{e, {}};
      double weight = mesh.xi_gradient(mesh.reference(), {e, {0.5, 0.5, 0.5}}).determinant();
      for (size_t k = 0; k < 3; ++k) {
        point.xi[k] = rule.place[index[k]];
        weight *= rule.weight[index[k]];
      }
      visit(point, mesh.value(mesh.reference(), point), weight);
    }
  }
}

/// Integral of P : dN_a/dX over the body, as a right side over the unknowns.
std::vector<double> loads(const ManufacturedCase& made_up, const ElasticSystem& system) {
  const HermiteMesh& mesh = system.mesh();
  std::vector<ElementField> forces(mesh.element_count(), ElementField::Zero());
  for_each_point(mesh, [&](const MaterialPoint& point, const Vector3d& at, double weight) {
    const Matrix3d to_xi = mesh.xi_gradient(mesh.reference(), point).inverse();
    const Matrix3d flux = weight * exact_stress_kPa(made_up, at) * to_xi.transpose();
    const HermiteBasis basis = hermite_basis(point.xi);
    for (size_t a = 0; a < hermite_functions; ++a) {
      forces[point.element].col(static_cast<Index>(a)) +=
          flux * Vector3d(basis.slope[0][a], basis.slope[1][a], basis.slope[2][a]);
    }
  });
  std::vector<double> right_side(system.equations().unknowns(), 0.0);
  for (size_t e = 0; e < forces.size(); ++e)
    system.equations().add_force(e, forces[e], right_side);
  return right_side;
}

/// Newton's method with the made-up loads, started at the made-up positions and no pressure.
bool solve(ElasticSystem& system, const std::vector<double>& load, ElasticState& state,
           size_t& negative_pivots) {
  for (int iteration = 0; iteration < 12; ++iteration) {
    std::vector<double> step = system.residual(state).values;
    for (size_t i = 0; i < step.size(); ++i)
      step[i] = load[i] - step[i];
    const FactorResult factor = system.factorise(state);
    if (factor.singular) return false;
    negative_pivots = factor.negative_pivots;
    system.solve(step);
    state = system.moved(state, step, 1.0);
    double largest = 0.0;
    for (const double change : step)
      largest = std::max(largest, std::abs(change));
    if (largest < 1e-11) return true;
  }
  return false;
}

void measure(const ManufacturedCase& made_up, const ElasticSystem& system, const ElasticState& state,
             ManufacturedErrors& errors) {
  const HermiteMesh& mesh = system.mesh();
  const ElasticState averaged = with_averaged_pressure(system, state);
  for_each_point(mesh, [&](const MaterialPoint& point, const Vector3d& at, double weight) {
    const std::array<Mixed, 3> exact = deformed(at);
    const Vector3d x(exact[0].part[0], exact[1].part[0], exact[2].part[0]);
    errors.displacement_L2_mm += weight * (mesh.value(state.position_mm, point) - x).squaredNorm();
    errors.displacement_H1 +=
        weight * (mesh.reference_gradient(state.position_mm, point) - deformation_gradient(at)).squaredNorm();
    const std::array<double, corners> basis = trilinear_basis(point.xi);
    const auto pressure_error_kPa = [&](const std::vector<double>& corner_values) {
      double error = -exact_pressure_kPa(made_up, at);
      for (size_t m = 0; m < corners; ++m)
        error += basis[m] * corner_values[corners * point.element + m];
      return error;
    };
    errors.pressure_L2_kPa += weight * std::pow(pressure_error_kPa(state.lagrange_pressure_kPa), 2);
    errors.averaged_pressure_L2_kPa +=
        weight * std::pow(pressure_error_kPa(averaged.lagrange_pressure_kPa), 2);
    const Matrix3d stress_kPa = exact_stress_kPa(made_up, at) * deformation_gradient(at).transpose();
    errors.stress_L2_kPa +=
        weight * (point_fields(system, averaged, point).stress_kPa - stress_kPa).squaredNorm();
  });
  for (double* error : {&errors.displacement_L2_mm, &errors.displacement_H1, &errors.pressure_L2_kPa,
                        &errors.averaged_pressure_L2_kPa, &errors.stress_L2_kPa})
    *error = std::sqrt(*error);
}

}  // namespace

std::vector<ManufacturedCase> manufactured_cases() {
  const Law* neo_hookean = find_law("neo-hookean");
  const Law* guccione = find_law("guccione");
  const std::vector<double> tissue{2.0, 8.0, 2.0, 4.0};
  return {{"neo-hookean, curved p", neo_hookean, {1.0}, false, 1.0},
          {"neo-hookean, tri-linear p", neo_hookean, {1.0}, false, 0.0},
          {"guccione, curved p", guccione, tissue, true, 1.0},
          {"guccione, tri-linear p", guccione, tissue, true, 0.0}};
}

ManufacturedErrors solve_manufactured(const ManufacturedCase& made_up, size_t n) {
  ElasticOptions options;
  HermiteMesh mesh = make_block({{1.0, 1.0, 1.0}, {n, n, n}});
  options.parameters = made_up.parameters;
  HeldDofs held = hold_nothing(mesh);
  for (const auto& face : {mesh.faces().left, mesh.faces().bottom, mesh.faces().inner})
    hold_face(mesh, face, held);
  options.held = std::move(held);
  options.material_axes = [&](const HermiteMesh& of, const MaterialPoint& point) {
    return material_axes(made_up, of.value(of.reference(), point));
  };
  ElasticSystem system(std::move(mesh), *made_up.law, options);
  ElasticState state = system.rest_state();
  state.position_mm =
      mapped(system.mesh(), [](const std::array<Mixed, 3>& reference) { return deformed(reference); });
  ManufacturedErrors errors;
  errors.unknowns = system.equations().unknowns();
  errors.pressure_unknowns = system.equations().pressure_unknowns();
  errors.converged = solve(system, loads(made_up, system), state, errors.negative_pivots);
  measure(made_up, system, state, errors);
  return errors;
}

double convergence_order(double coarse, double fine, size_t coarse_n, size_t fine_n) {
  return std::log(coarse / fine) / std::log(static_cast<double>(fine_n) / static_cast<double>(coarse_n));
}

}  // namespace diastole
