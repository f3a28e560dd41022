#pragma once
// The posterior of all unknowns by Markov chains on the true likelihood: every step solves the equilibria of all
// frames; nothing is taken from the quadratic model but the shape of the proposals.
//
// Preconditioned Crank-Nicolson steps about the estimate (Cotter et al., Stat. Sci. 28 (2013) 424; generalised by
// Rudolf & Sprungk, Found. Comput. Math. 18 (2018) 309): with Sigma the covariance at the estimate m,
//
//   q' = m + sqrt(1 - beta^2) (q - m) + beta xi,  xi ~ N(0, Sigma);   accepted with min(1, exp(phi(q) - phi(q'))),
//   phi(q) = cost(q) - (q - m) Sigma^-1 (q - m) / 2
//
// Where the posterior is normal every step is accepted, whatever the number of unknowns; beta is adapted during
// warm-up only. Several chains start apart, and split R-hat and the effective sample size (Gelman et al., Bayesian
// Data Analysis, 3rd ed., 11.4) show whether they agree. Unknowns stay within their bounds.

#include <functional>
#include <vector>

#include "estimator/fit/joint_problem.hpp"

namespace diastole {

struct PosteriorOptions {
  int chains = 4;
  int steps = 250;   ///< of each chain after its warm-up
  int warm_up = 60;  ///< adapts beta, is thrown away
  unsigned seed = 1;
  std::function<void(int done, int all)> on_step;
  std::function<bool()> interrupted;  ///< asked before each step: true ends the drawing, without a sample
};

struct PosteriorSample {
  std::vector<Eigen::MatrixXd> chains;  ///< a row a step, a column an unknown
  double accepted = 0;                  ///< share of steps
  long solutions = 0;                   ///< equilibria solved
  bool interrupted = false;
};

/// `best` is the estimate with its covariance; unknowns of no variance (on a bound) stay there.
PosteriorSample sample_posterior(JointProblem& problem, const Eigen::VectorXd& best,
                                 const Eigen::MatrixXd& covariance, const PosteriorOptions& options);

/// Split R-hat of one unknown: 1 when the halves of all chains agree.
double split_r_hat(const std::vector<Eigen::VectorXd>& chains);

/// How many independent draws the chains are worth together.
double effective_sample_size(const std::vector<Eigen::VectorXd>& chains);

}  // namespace diastole
