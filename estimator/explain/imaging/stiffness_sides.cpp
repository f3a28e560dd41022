#include "estimator/explain/imaging/stiffness_sides.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "estimator/fe/gauss_contraction.hpp"

namespace diastole::explain {
namespace {

/// The law's share of - (first Piola-Kirchhoff stress) at the Gauss points, by xi and times their volumes.
std::array<Eigen::Matrix3d, gauss_points> law_forces(const ElasticSystem& system, const ElasticState& state,
                                                     size_t element) {
  const HermiteMesh& mesh = system.mesh();
  const ReferenceElement reference = make_reference_element(mesh, element, system.material_axes());
  const GaussMatrices gradients = gradients_at_points(mesh.gather(element, state.position_mm));
  const double C1_kPa = system.parameters(element).front();
  std::array<Eigen::Matrix3d, gauss_points> forces;
  for (size_t q = 0; q < gauss_points; ++q) {
    const Eigen::Matrix3d& t = reference[q].material_to_xi;
    const Eigen::Matrix3d f = gradients.at(q) * t;
    const SymmetricTensor<double> by_C1 =
        system.law().stress_sensitivity(symmetric_part(f.transpose() * f), system.parameters(element), 0);
    forces[q] = -C1_kPa * reference[q].volume * f * full_matrix(by_C1) * t.transpose();
  }
  return forces;
}

}  // namespace

GaussNumbers at_gauss_points(const HermiteMesh& mesh, const StiffnessField& field) {
  GaussNumbers numbers(mesh.element_count());
  for (size_t e = 0; e < mesh.element_count(); ++e)
    for (size_t q = 0; q < gauss_points; ++q)
      numbers[e][q] = field(mesh.value(mesh.reference(), {e, gauss_tables().xi[q]}));
  return numbers;
}

std::vector<std::vector<double>> stiffness_sides(const ElasticSystem& system, const ElasticState& state,
                                                 const std::vector<GaussNumbers>& fields) {
  constexpr double least = 1e-6;
  const HermiteMesh& mesh = system.mesh();
  std::vector<std::vector<double>> sides(fields.size(),
                                         std::vector<double>(system.equations().unknowns(), 0.0));
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::optional<std::array<Eigen::Matrix3d, gauss_points>> forces;
    for (size_t i = 0; i < fields.size(); ++i) {
      const std::array<double, gauss_points>& here = fields[i][e];
      if (std::ranges::all_of(here, [](double value) { return std::abs(value) <= least; })) continue;
      if (!forces) forces = law_forces(system, state, e);
      GaussMatrices weighted;
      for (size_t q = 0; q < gauss_points; ++q)
        weighted.set(q, here[q] * (*forces)[q]);
      system.equations().add_force(e, force_of(weighted), sides[i]);
    }
  }
  return sides;
}

}  // namespace diastole::explain
