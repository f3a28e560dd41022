#pragma once
// Profile-likelihood intervals: how far one unknown can be moved, all others adjusting themselves, until the cost has
// risen by half of chi-square's 95 % point (1.92). Right where the likelihood is not a parabola, which the symmetric
// interval takes it for (Venzon & Moolgavkar, Appl. Stat. 37 (1988) 87). Each end costs three to five searches with the
// full model, one of them half-way, for the picture.

#include <array>
#include <functional>
#include <vector>

#include "estimator/inference/least_squares.hpp"

namespace diastole::inference {

struct ProfileEnd {
  double coordinate;                              ///< of the unknown at the end
  bool at_bound;                                  ///< the data do not end the interval: the bound does
  bool found;                                     ///< false if the search did not settle
  std::vector<std::array<double, 2>> tried = {};  ///< coordinates and how far the cost rises there
};

/// The optimum of a problem with its cost (half of chi-square) and the covariance there.
struct ProfiledOptimum {
  LeastSquaresProblem& problem;
  const Eigen::VectorXd& best;
  const Eigen::MatrixXd& covariance;
  double cost;
  std::function<bool()> interrupted = {};  ///< asked at each step: true ends the search, with ends not found
};

/// Both ends of unknown `which`, the lower coordinate's first. Precondition: its variance is finite and not 0.
std::array<ProfileEnd, 2> profile_interval(const ProfiledOptimum& at, Eigen::Index which);

}  // namespace diastole::inference
