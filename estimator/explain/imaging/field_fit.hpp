#pragma once
// The fit of a field model to imaged motion: C1, the parameters of some effects (or none), and the true pressure of each
// frame, by least squares (estimator/inference/least_squares.hpp) with exact derivatives.
//
//   chi2 = sum over tags and points (residual / sigma)^2  +  sum over frames ((P - measured) / sigma)^2
//        + ((C1 - start) / C1_sigma)^2, if the study knows C1
//        + ((inner radius - seen) / sigma)^2, if frame 0 shows where the wall begins

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/imaging/field_case.hpp"
#include "estimator/explain/imaging/field_solver.hpp"
#include "estimator/inference/parameter_space.hpp"
#include "estimator/inference/termination.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"

namespace diastole::explain {

/// Of chi2: a search of an imaged specimen's model, gel or other, ends where a step gains no more.
inline constexpr double worth_a_step = 0.02;

/// How an effect's parameter is searched.
inference::Parameter searched(const EffectParameter& parameter);

/// Effects in a fit, with those of their parameters that are free.
struct FieldChoice {
  std::vector<const Effect*> effects;  ///< none: the base model
  std::vector<double> values;          ///< start, then result; one effect's parameters after the other's
  std::vector<size_t> free;            ///< among the values

  [[nodiscard]] const EffectParameter& parameter(size_t value) const;
  void apply_to(FieldModel& model) const;
};

/// One choice beside another, which must not have the same effects.
FieldChoice together(const FieldChoice& a, const FieldChoice& b);

struct FieldFit {
  FieldChoice choice;
  std::vector<double> law;  ///< the values of the law that are searched; of gel C1 alone
  std::vector<double> pressures_kPa;
  double chi_square = 0.0;
  /// Nothing but a settled fit may be named; no_solution: the start has no equilibrium, and chi_square is infinite.
  inference::Termination termination = inference::Termination::no_solution;
  /// Order of unknowns: the law's (positive ones by their logarithm), free parameters in their search coordinates, pressures, others.
  /// Nothing of unknowns on a bound, infinite for those that are not determined.
  Eigen::MatrixXd covariance;
  std::vector<std::string> undetermined;  ///< combinations of unknowns that move no residual, in words
  Eigen::VectorXd residuals;              ///< of the rows, in sigmas
  Eigen::MatrixXd jacobian;               ///< of the rows, then of the priors
  Eigen::VectorXd priors;                 ///< the remaining residuals
  /// Intervals of choice.values where the covariance does not give them; empty: it does.
  std::vector<std::array<double, 2>> ci90;

  /// Of gel.
  [[nodiscard]] double C1_kPa() const { return law.front(); }
  /// Rows, then priors.
  [[nodiscard]] Eigen::VectorXd all_residuals() const;
};

/// The fit's covariance by its Jacobian, and what that does not determine. `space`: of the Jacobian's columns.
void estimate_covariance(FieldFit& fit, const inference::ParameterSpace& space,
                         const std::vector<bool>& is_free);

class FieldProblem {
 public:
  FieldProblem(const FieldCase& field, std::array<size_t, 3> elements);

  struct Start {
    double C1_kPa;
    std::vector<double> pressures_kPa;
  };
  /// Until no step gains more than 0.02 of chi2.
  [[nodiscard]] FieldFit fit(FieldChoice choice, const Start& start, std::optional<int> iteration_limit = {});
  [[nodiscard]] Start start() const;
  /// What the cavity of a fit's specimen takes at the highest node; NaN without an equilibrium. The solver stands there
  /// afterwards, the rows stay.
  [[nodiscard]] double volume_change_mL(const FieldFit& fit);

  /// Its slots stand at nodes_kPa().
  [[nodiscard]] FieldSolver& solver() { return solver_; }
  /// The pressures at which equilibria are solved. Between them displacement over pressure is their polynomial: with
  /// three nodes right to 1e-3 of a tag's error.
  [[nodiscard]] const std::vector<double>& nodes_kPa() const { return nodes_kPa_; }
  [[nodiscard]] size_t highest_node() const { return nodes_kPa_.size() - 1; }
  /// What each node's displacement counts at a pressure.
  [[nodiscard]] std::vector<double> shares(double pressure_kPa) const;
  [[nodiscard]] const MotionResiduals& rows() const { return rows_; }
  [[nodiscard]] const FieldCase& field() const { return field_; }

 private:
  class Search;
  [[nodiscard]] FieldModel model_of(const FieldChoice& choice) const;

  FieldCase field_;
  FieldSolver solver_;
  MotionResiduals rows_;
  std::vector<double> nodes_kPa_;
};

}  // namespace diastole::explain
