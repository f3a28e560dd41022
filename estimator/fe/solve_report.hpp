#pragma once
// How a forward solution ended, with its history: a value, never an exception.

#include <Eigen/Dense>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

enum class SolveReason {
  converged,
  inverted_element,  ///< the material turns inside out however small the load step
  beyond_law,        ///< a strain at which the law has no stress, such as a pole, however small the load step
  no_convergence,    ///< Newton's method stalls however small the load step
  singular_tangent,  ///< the factorisation met a zero pivot: a missing support, or a limit point
  limit_point,  ///< the cavity's pressure has a maximum or minimum; judged by the last equilibrium (PressureLimit)
  out_of_steps  ///< the load-step limit was reached
};

/// "converged", "inverted element", ... for reports and JSON.
std::string_view describe(SolveReason reason);

/// Where an element is turned inside out: the volume ratio J there is not positive.
struct InvertedPlace {
  MaterialPoint point;
  Eigen::Vector3d reference_mm;
  double volume_ratio = 0.0;
};

/// The cavity's stiffness dP/dV has nearly vanished at the last equilibrium: a little further the pressure has an
/// extremum, beyond which no equilibrium follows, whatever the attempts there failed of.
struct PressureLimit {
  double pressure_kPa = 0.0;  ///< reached
  double left = 0.0;          ///< of dP/dV at rest
  bool maximum = true;        ///< else a minimum
};

/// One step of Newton's method: a new tangent, then corrections that reuse its factors.
struct NewtonIteration {
  double step = 0.0;       ///< size of the correction, relative to the body (newton.hpp)
  double damping = 1.0;    ///< fraction of the step that was taken
  size_t corrections = 0;  ///< simplified corrections after it
};

struct LoadStep {
  double pressure_kPa = 0.0;  ///< at its end
  bool accepted = false;
  std::vector<NewtonIteration> iterations;
};

struct SolveReport {
  SolveReason reason = SolveReason::converged;
  std::vector<LoadStep> history;
  size_t load_steps = 0;         ///< accepted ones
  size_t newton_iterations = 0;  ///< updates of the state: with a new tangent or with kept factors
  size_t factorisations = 0;     ///< tangents assembled and factorised on the way
  /// One a pressure unknown, and more if the state is unstable or, spuriously, on a coarse mesh. Of the solution's tangent if SolveOptions::check_stability asks
  /// for it or the cavity's wall has a free rim, else of the last one on the way.
  size_t negative_pivots = 0;
  std::optional<size_t> unstable_motions;  ///< with check_stability, where known: elastic_system.hpp
  bool singular = false;                   ///< with check_stability: the solution's tangent
  size_t pressure_unknowns = 0;            ///< Lagrange pressures, and those of fluids that are unknown
  double reached_pressure_kPa = 0.0;
  std::optional<InvertedPlace> inverted;
  std::optional<size_t> beyond_law;  ///< the element
  std::optional<PressureLimit> pressure_limit{};
  double seconds = 0.0;

  [[nodiscard]] bool converged() const { return reason == SolveReason::converged; }
  /// Of the last equilibrium; not known unless asked for, nor with a free rim (elastic_system.hpp).
  [[nodiscard]] std::optional<bool> stable() const;
  /// A sentence for a person: what happened, where, at which pressure, and what may help.
  [[nodiscard]] std::string describe() const;
};

struct SolveOptions {
  double tolerance = 1e-9;   ///< relative size of the last correction
  size_t newton_limit = 12;  ///< tangents a load step
  size_t load_step_limit = 200;
  double least_load_fraction = 1e-3;  ///< of the pressure change asked for
  double most_load_fraction = 1.0;
  bool check_stability = false;  ///< count negative pivots at the solution: one more factorisation or two
  /// Called after each Newton iteration, for a progress line.
  std::function<void(double pressure_kPa, const NewtonIteration&)> on_iteration{};
};

}  // namespace diastole
