#pragma once
// Bounded least squares: minimise |r(q)|^2 / 2 by Levenberg-Marquardt (Ceres Solver's trust-region minimiser).
//
//   class Line : public LeastSquaresProblem { ... };
//   const SearchResult found = minimise(problem, start, {.iteration_limit = 20});
//   if (is_settled(found.termination)) ...
//
// A trial point without a solution counts as a failed step: the trust region shrinks and the search goes on. A search
// whose trust region has shrunk to nothing has small steps, too: it counts as converged only if the cost's quadratic
// model promises nothing any more, and has stalled otherwise.
//
// An unknown that rests on its bound while the cost falls only beyond it is held there for the next step: its column of
// the Jacobian is zero, so that the step is the others' own best one and not one that is spoilt when the bound cuts it
// off. Each accepted point decides anew by the sign of the gradient, the bound's multiplier (active set: D. P.
// Bertsekas, SIAM J. Control Optim. 20 (1982) 221).
//
// Where a Jacobian costs many solutions (Linearisation::kept), Broyden's updates keep it from point to point. It is
// computed afresh when a step is refused on a kept one, when a step gains less than a quarter of what was expected, and
// when the search would end on one that has been kept over more than two standard errors, unless it has crept (a caller
// may go on with better derivatives).

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/inference/parameter_space.hpp"
#include "estimator/inference/termination.hpp"

namespace diastole::inference {

enum class Linearisation {
  fresh,  ///< the Jacobian is computed at every accepted point
  kept    ///< by Broyden's updates as long as they hold
};

class LeastSquaresProblem {
 public:
  virtual ~LeastSquaresProblem() = default;
  [[nodiscard]] virtual const ParameterSpace& space() const = 0;
  /// In standard deviations, as many at every q within the bounds; nothing (and `failure`) where the model has no
  /// solution.
  virtual std::optional<Eigen::VectorXd> residuals(const Eigen::VectorXd& q) = 0;
  /// Derivatives of the residuals by q, exact or by differences. `residuals(q)` has succeeded; it was the last call
  /// unless the Jacobian is kept.
  virtual Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) = 0;
  [[nodiscard]] virtual Linearisation linearisation() const { return Linearisation::fresh; }
  /// Why the last `residuals` returned nothing.
  [[nodiscard]] virtual std::string failure() const { return "the model has no solution there"; }
};

/// Derivatives of residuals where a model has none of its own, by central differences of 1e-6 in each coordinate, which
/// should be of order one. Precondition: the problem has a solution there.
Eigen::MatrixXd central_differences(LeastSquaresProblem& problem, const Eigen::VectorXd& q);

struct SearchStep {
  int iteration;
  double cost;  ///< half of chi-square at q
  bool accepted;
  Eigen::VectorXd q;  ///< the best unknowns so far
};

struct SearchOptions {
  int iteration_limit = 50;
  int iterations_before = 0;  ///< of earlier searches: they count towards the limit
  /// The search ends when the cost changes by less than this fraction in a step.
  double cost_tolerance = 1e-9;
  /// ... or when the unknowns do.
  double step_tolerance = 1e-8;
  /// ... or, where given, when chi-square is expected to fall by less than this in the best step, or did so in a step
  /// that was hardly damped. Called with chi-square. Ten steps in a row that together bring less, while more is expected, end it as
  /// stalled and crept.
  std::function<double(double chi_square)> small_gain = {};
  /// So many refused steps in a row end the search.
  int refusal_limit = 1000;
  std::vector<bool> held = {};        ///< unknowns that keep their start values; empty: none
  Eigen::VectorXd longest_step = {};  ///< of each coordinate in one iteration; empty: no limit
  /// Radius of the first trust region: steps are damped by its inverse, relative to the columns' squares.
  double first_radius = 1e4;
  std::function<void(const SearchStep&)> on_step = {};
  /// Asked after each step: true ends the search with the best so far.
  std::function<bool()> interrupted = {};
  /// The same of a search that is not worth its time.
  std::function<bool(const SearchStep&)> hopeless = {};
};

struct SearchResult {
  Eigen::VectorXd q;
  Termination termination = Termination::no_solution;
  bool crept = false;         ///< its last ten steps together brought less than the small gain
  std::string reason;         ///< a sentence
  int iterations = 0;         ///< steps tried
  int evaluations = 0;        ///< calls of `residuals`
  int linearisations = 0;     ///< calls of `jacobian`
  std::vector<bool> pressed;  ///< the unknowns that rest on a bound beyond which the cost falls
  Eigen::VectorXd residuals;  ///< at q; empty without a solution
  /// At q, as the search had it; where it was kept, right to about the last steps' curvature.
  Eigen::MatrixXd jacobian;

  [[nodiscard]] double cost() const { return 0.5 * residuals.squaredNorm(); }
};

/// Precondition: `start` has a coordinate for each parameter; it is clamped to the bounds.
SearchResult minimise(LeastSquaresProblem& problem, const Eigen::VectorXd& start,
                      const SearchOptions& options);

}  // namespace diastole::inference
