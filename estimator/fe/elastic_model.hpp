#pragma once
// The forward model: a meshed specimen of one material law, held at its plates, inflated by a cavity
// pressure.
//
//   ElasticModel model(make_annulus({}), *find_law("neo-hookean"), {.parameters = {8.71}});
//   Solution solution = model.solve(3.1);                     // from rest
//   if (!solution.report.converged()) ... solution.report.describe()
//   Eigen::Vector3d x = model.mesh().value(solution.state.position_mm, {element, xi});
//   Eigen::Matrix3d F = model.mesh().reference_gradient(solution.state.position_mm, {element, xi});
//   double volume_change_mL =
//       model.cavity_volume_mL(solution.state) - model.cavity_volume_mL(model.rest_state());
//   model.set_parameter(0, 9.0);                              // whole body; set_element_parameter for one element
//   solution = model.solve(3.1, solution.state);              // warm start
//   Sensitivities by = model.sensitivities(solution.state, {whole_parameter(0)});
//   Eigen::Vector3d dx_dC1 = model.mesh().value(by.parameter[0], {element, xi});
//   Eigen::Vector3d dx_dP = model.mesh().value(by.pressure, {element, xi});
//
// Equations: element_mechanics.hpp, cavity_load.hpp; Newton's method: newton.hpp; load steps: load_path.hpp.
// Units: mm, kPa, mL. A model is used by one thread at a time (it works in parallel itself, as ElasticSystem::set_threads says).

#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "estimator/fe/elastic_system.hpp"

namespace diastole {

/// A direction in parameter space: one parameter of the law, varied by the same amount in some elements.
struct ParameterGroup {
  size_t parameter = 0;
  std::vector<size_t> elements;  ///< empty: all
};

ParameterGroup whole_parameter(size_t parameter);
/// One group for each element.
std::vector<ParameterGroup> each_element(size_t parameter, size_t element_count);

/// Derivatives of the equilibrium at one state. All are node fields like ElasticState::position_mm, in mm per
/// unit of the parameter (or per kPa of cavity pressure); zero at held dofs.
struct Sensitivities {
  std::vector<NodeField> parameter;  ///< one for each group asked for
  NodeField pressure;                ///< dx/dP
  size_t negative_pivots = 0;        ///< of the tangent at this state
};

class ElasticModel {
 public:
  /// Precondition: as many parameters as the law has.
  ElasticModel(HermiteMesh mesh, const Law& law, const ElasticOptions& options)
      : system_(std::make_unique<ElasticSystem>(std::move(mesh), law, options)),
        solve_options_(options.solve) {}
  /// A copy may work in another thread; it shares the ordering of the tangent and the factor that was kept.
  ElasticModel(const ElasticModel& other)
      : system_(std::make_unique<ElasticSystem>(*other.system_)), solve_options_(other.solve_options_) {}
  ElasticModel(ElasticModel&&) = default;
  ElasticModel& operator=(ElasticModel&&) = default;

  [[nodiscard]] const HermiteMesh& mesh() const { return system_->mesh(); }
  [[nodiscard]] const Law& law() const { return system_->law(); }
  /// Unknowns of the discrete problem: free displacement dofs plus Lagrange pressures.
  [[nodiscard]] size_t dofs() const { return system_->equations().unknowns(); }
  [[nodiscard]] size_t pressure_dofs() const { return system_->equations().pressure_unknowns(); }

  void set_parameter(size_t parameter, double value);
  void set_element_parameter(size_t parameter, size_t element, double value) {
    system_->parameters(element)[parameter] = value;
  }
  [[nodiscard]] double element_parameter(size_t parameter, size_t element) const {
    return std::as_const(*system_).parameters(element)[parameter];
  }

  /// Undeformed, unloaded; the Lagrange pressure balances the law's stress at rest.
  [[nodiscard]] ElasticState rest_state() const { return system_->rest_state(); }

  /// Equilibrium at a cavity pressure, from rest or from an earlier state (of any pressure and parameters).
  [[nodiscard]] Solution solve(double pressure_kPa);
  [[nodiscard]] Solution solve(double pressure_kPa, const ElasticState& start);
  /// The same for any load; pressure (or volume) and tension go from the start's to the load's in proportion. A pressure
  /// that is not reached is judged by the last equilibrium: SolveReason::limit_point.
  /// Precondition: a volume is asked only of a closed cavity (ElasticSystem::cavity_closed).
  /// The factor of a tangent near the solution (`ElasticSystem::kept_factor`) is tried first, if there is one.
  [[nodiscard]] Solution solve(const Load& load, const ElasticState& start,
                               std::shared_ptr<const CondensedFactor> near_by = {});

  /// Exact derivatives at a converged state, at constant cavity pressure: one factorisation, one back-substitution a group.
  /// Throws std::domain_error where the tangent is singular (a limit point, a missing support): there are none.
  [[nodiscard]] Sensitivities sensitivities(const ElasticState& state,
                                            std::span<const ParameterGroup> groups);

  [[nodiscard]] double cavity_volume_mL(const ElasticState& state) const;
  /// dP/dV of the closed cavity at an equilibrium; negative beyond a pressure maximum. None if the tangent at held volume
  /// is singular.
  [[nodiscard]] std::optional<double> cavity_stiffness_kPa_per_mL(const ElasticState& state);
  /// In the material (integral of W) and in springs, mJ (kPa mL).
  [[nodiscard]] double stored_energy_mJ(const ElasticState& state) const;

  /// The discrete equations themselves, for verification and for what is derived from a solution.
  [[nodiscard]] ElasticSystem& system() { return *system_; }
  [[nodiscard]] const ElasticSystem& system() const { return *system_; }

 private:
  void judge_end(Solution& path, const Load& load, double start_kPa);

  std::unique_ptr<ElasticSystem> system_;
  SolveOptions solve_options_;
};

}  // namespace diastole
