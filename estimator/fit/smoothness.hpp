#pragma once
// Neighbouring elements resemble each other: the prior of a parameter that varies by element, and how strong the
// data themselves say it is.
//
// With q the parameter's coordinates (logarithms of positive values), one an element,
//
//   log p(q | step) = -1/2 sum over faces between elements  w (q_i - q_j)^2 / step^2  +  rank log(1/step)  + const
//
// w is the face's area over the distance of the two centres, scaled to a mean of one: the finite-volume form of
// an integral of |grad q|^2, so that a finer mesh does not change the prior. `step` is thus the usual difference
// between neighbours (0.05: five per cent). The mean over the body is left free (intrinsic Gaussian Markov field:
// Rue & Held, Gaussian Markov Random Fields, 2005, chapter 3).
//
// The step is the one of greatest evidence: p(data | step) with q integrated out, on the Gauss-Newton model of the
// data (MacKay, Neural Computation 4 (1992) 415). How little the data know about the step is not dropped: the
// values reported and their covariance are integrated over it, with a flat prior on the step (Gelman, Bayesian Analysis 1
// (2006) 515). The search itself uses the step of greatest evidence.

#include <Eigen/Dense>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// One row sqrt(w) (q_i - q_j) for each face that two elements share.
Eigen::MatrixXd neighbour_differences(const HermiteMesh& mesh);

/// A run of unknowns that are smooth.
struct SmoothBlock {
  Eigen::Index first;
  Eigen::MatrixXd differences;  ///< a row a face, a column a value of the block
  double step;
};

/// The quadratic model of the data's cost at q: cost + gradient·d + d·hessian·d/2, priors of pressures included.
struct QuadraticModel {
  Eigen::VectorXd q;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
};

struct EvidenceOfStep {
  double step;     ///< of greatest evidence
  bool none_seen;  ///< the evidence only falls with the step: no difference between elements is seen
  std::vector<double> steps;       ///< a grid ...
  std::vector<double> weights;     ///< ... and the step's posterior on it; they add up to 1
  std::vector<Eigen::VectorXd> q;  ///< the unknowns that each step on the grid gives
  std::vector<Eigen::MatrixXd> covariance;
};

/// Evidence of the step of `blocks[which]`, the other blocks at theirs. Unknowns that are not free stay at q.
EvidenceOfStep evidence_of_step(const QuadraticModel& model, const std::vector<SmoothBlock>& blocks,
                                size_t which, const std::vector<bool>& is_free);

}  // namespace diastole
