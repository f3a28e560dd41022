#pragma once
// The paper's own search, for comparison: sequential quadratic programming (SLSQP of NLopt, Kraft 1994) on the sum of
// squared distances in mm (Eq. 6), every derivative a forward difference of new equilibria, parameters in their own
// units, ended when a step changes them by less than 0.001 of their norm. Frame pressures are taken as exact.

#include "estimator/fit/joint_problem.hpp"

namespace diastole {

inline constexpr double paper_tolerance = 0.001;

/// Precondition: the problem has no unknown pressures, smoothness or robust loss. `iterations` are the points at
/// which a gradient was formed; costs in the history are half the sum of squares, mm².
inference::SearchResult paper_search(JointProblem& problem, const Eigen::VectorXd& start,
                                     const inference::SearchOptions& options);

}  // namespace diastole
