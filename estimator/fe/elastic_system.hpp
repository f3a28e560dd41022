#pragma once
// The discrete equations of an elastic body: residual, tangent and its factor, parameter derivatives.
// Elements are worked on in parallel, and summed colour by colour, so that the result does not depend on the
// number of threads.

#include <optional>
#include <span>
#include <vector>

#include "estimator/fe/cavity_load.hpp"
#include "estimator/fe/elastic_state.hpp"
#include "estimator/fe/element_mechanics.hpp"
#include "estimator/fe/equation_system.hpp"
#include "estimator/fe/solve_report.hpp"
#include "estimator/fe/symmetric_factor.hpp"
#include "estimator/materials/law.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct SystemResidual {
  std::vector<double> values;  ///< dPi/d(unknown): kPa mm^2 for displacements, mm^3 for pressures
  double energy_uJ = 0.0;      ///< integral of W
  std::optional<InvertedPlace> inverted;
};

struct SystemOptions {
  std::vector<double> parameters;  ///< the law's, in its order; the same in all elements
  PressureSpace pressure_space = PressureSpace::per_element;
  HeldDofs held;
  std::vector<ElementFace> loaded;    ///< faces that the cavity pressure pushes on
  MaterialAxesField material_axes;    ///< empty: the coordinate axes
  double volume_stiffness_kPa = 0.0;  ///< kappa of element_mechanics.hpp
  size_t threads = 1;
};

class ElasticSystem {
 public:
  ElasticSystem(HermiteMesh mesh, const Law& law, const SystemOptions& options);

  [[nodiscard]] const HermiteMesh& mesh() const { return mesh_; }
  [[nodiscard]] const Law& law() const { return *law_; }
  [[nodiscard]] const EquationSystem& equations() const { return equations_; }
  [[nodiscard]] const PressureMap& pressures() const { return pressures_; }
  [[nodiscard]] const MaterialAxesField& material_axes() const { return material_axes_; }
  [[nodiscard]] double volume_stiffness_kPa() const { return volume_stiffness_kPa_; }
  [[nodiscard]] std::span<double> parameters(size_t element) {
    return {&parameters_[element * count_], count_};
  }
  [[nodiscard]] std::span<const double> parameters(size_t element) const {
    return {&parameters_[element * count_], count_};
  }

  [[nodiscard]] ElasticState rest_state() const;
  [[nodiscard]] double cavity_volume_mm3(const ElasticState& state) const;

  [[nodiscard]] SystemResidual residual(const ElasticState& state) const;
  /// Values of the stored entries of equations(), at a state.
  [[nodiscard]] std::vector<double> tangent(const ElasticState& state) const;
  /// The loaded faces' area vectors, mm^2: minus the derivative of the residual with respect to the cavity
  /// pressure, and dV_cavity/d(unknown) if the cavity's wall is what is loaded.
  [[nodiscard]] std::vector<double> cavity_area(const ElasticState& state) const;
  /// d(residual)/d(parameter) summed over the elements of a group (empty: all), added to `target`.
  void add_parameter_residual(const ElasticState& state, size_t parameter, std::span<const size_t> elements,
                              std::span<double> target) const;

  /// Assembles and factorises the tangent; solve() uses it until the next call.
  FactorResult factorise(const ElasticState& state);
  void solve(std::span<double> right_sides, size_t count = 1) { factor_.solve(right_sides, count); }

  /// state + fraction * step over the unknowns.
  [[nodiscard]] ElasticState moved(const ElasticState& state, std::span<const double> step,
                                   double fraction) const;
  /// The displacement part of a vector over the unknowns, as a node field (zero at held dofs).
  [[nodiscard]] NodeField node_field(std::span<const double> unknowns) const;

 private:
  [[nodiscard]] ElementState element_state(const ElasticState& state, size_t element) const;

  HermiteMesh mesh_;
  const Law* law_;
  size_t count_;  // parameters of the law
  std::vector<double> parameters_;
  PressureMap pressures_;
  EquationSystem equations_;
  std::vector<ElementFace> loaded_;
  MaterialAxesField material_axes_;
  double volume_stiffness_kPa_;
  size_t threads_;
  std::vector<ReferenceElement> reference_;
  SymmetricFactor factor_;
};

}  // namespace diastole
