#pragma once
// The fit of a field model to imaged motion: C1, the parameters of one effect (or none), and the true pressure of each
// frame, by Levenberg-Marquardt with exact derivatives.
//
//   chi2 = sum over tags and points (residual / sigma)^2  +  sum over frames ((P - measured) / sigma)^2
//        + ((C1 - start) / C1_sigma)^2, if the study knows C1
//        + ((inner radius - seen) / sigma)^2, if frame 0 shows where the wall begins
//
// A study whose bounds of C1 are within 5 % of its start states an independent test's result: they are its interval of
// two standard deviations (docs/decisions/0071-field-effects-against-rivals.md).

#include <Eigen/Dense>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/imaging/field_solver.hpp"
#include "estimator/io/study.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"

namespace diastole::explain {

struct Measured {
  double value = 0.0;
  double sigma = 0.0;
};

/// What a study says about its specimen and what was measured on it.
struct FieldCase {
  FieldModel base;
  LocatorOptions locator;
  Measurement measurement;
  Measured C1_start_kPa;  ///< sigma 0: free within the bounds
  std::array<double, 2> C1_bounds_kPa{};
  std::optional<Measured> inner_radius_mm;  ///< as frame 0 shows it
  std::function<void()> alive = {};  ///< called before each equilibrium of a fit; ends it by an exception
};

/// Throws InputError unless the study is a neo-Hookean annulus with held ends and imaged motion.
FieldCase field_case(const Study& study);

/// The radius at which frame 0's tags begin, taking it that they come as near to the inner wall as to the outer one.
std::optional<Measured> seen_inner_radius(const Measurement& measurement, double outer_radius_mm);

/// Effects in a fit, with those of their parameters that are free.
struct FieldChoice {
  std::vector<const Effect*> effects;  ///< none: the base model
  std::vector<double> values;          ///< start, then result; one effect's parameters after the other's
  std::vector<size_t> free;            ///< among the values

  [[nodiscard]] const EffectParameter& parameter(size_t value) const;
  /// Place of an effect's first value.
  [[nodiscard]] size_t first_of(const Effect& effect) const;
  void apply_to(FieldModel& model) const;
};

/// One choice beside another, which must not have the same effects.
FieldChoice together(const FieldChoice& a, const FieldChoice& b);

struct FieldFit {
  FieldChoice choice;
  double C1_kPa = 0.0;
  std::vector<double> pressures_kPa;
  double chi_square = 0.0;
  bool converged = false;
  /// Order of unknowns: log C1, free parameters in their search coordinates, pressures.
  Eigen::MatrixXd covariance;
  Eigen::VectorXd residuals;  ///< of the rows, in sigmas
  Eigen::MatrixXd jacobian;   ///< of the rows, then of the priors
  Eigen::VectorXd priors;     ///< the remaining residuals
  /// Intervals of choice.values where the covariance does not tell them; empty: it does.
  std::vector<std::array<double, 2>> ci90;
};

class FieldProblem {
 public:
  FieldProblem(const FieldCase& field, std::array<size_t, 3> elements);

  struct Start {
    double C1_kPa;
    std::vector<double> pressures_kPa;
  };
  struct Options {
    int iteration_limit = 12;
    double tolerance = 0.02;  ///< of chi2, when the search ends
  };
  [[nodiscard]] FieldFit fit(FieldChoice choice, const Start& start, const Options& options);
  [[nodiscard]] FieldFit fit(FieldChoice choice, const Start& start) {
    return fit(std::move(choice), start, {});
  }
  [[nodiscard]] Start start() const;
  /// What the cavity of a fit's specimen takes at the highest node; NaN without an equilibrium. The solver stands there
  /// afterwards, the rows stay.
  [[nodiscard]] double taken_mL(const FieldFit& fit);

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
  struct Point;
  [[nodiscard]] FieldModel model_of(const FieldChoice& choice) const;
  [[nodiscard]] bool evaluate(Point& at);
  void differentiate(Point& at);
  [[nodiscard]] Eigen::VectorXd priors(const Point& at) const;

  FieldCase field_;
  FieldSolver solver_;
  MotionResiduals rows_;
  std::vector<double> nodes_kPa_;
};

/// Between a parameter's value and the coordinate in which it is searched.
double to_coordinate(const EffectParameter& parameter, double value);
double from_coordinate(const EffectParameter& parameter, double coordinate);

}  // namespace diastole::explain
