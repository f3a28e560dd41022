#pragma once
// The tags at rest as unknowns of a fit, where they were found in images themselves (Measurement::planes_as_seen).
//
// The planes of one slice and direction share their normal to the last digit: a set. Its planes were laid evenly and straight, but where,
// how far apart and how turned is only as sure as the first phase showed them, and an error there is alike in all frames: a spacing
// that is off by 1e-4 looks like a strain. So each set may
//
//   be shifted          a
//   be spread           b  at the outermost plane, in proportion from the middle
//   be turned           c  at the ends of the lines, in proportion along them                    (mm, all small)
//
// and the frames decide: what stays the same under all loads is no deformation.

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "estimator/io/measurement.hpp"

namespace diastole {

class TagPlanes {
 public:
  /// The priors' standard deviation: a fraction of a pixel, and ten times what the first phase leaves open.
  static constexpr double loose_mm = 0.25;
  static constexpr Eigen::Index of_a_set = 3;

  /// No sets where the planes are exactly known.
  explicit TagPlanes(const Measurement& measurement);

  [[nodiscard]] Eigen::Index unknowns() const { return of_a_set * sets_; }
  /// "tags[2] spread"
  [[nodiscard]] static std::string name(Eigen::Index unknown);
  /// By how much each tag's plane_mm changes. Precondition: `coefficients` has `unknowns()` numbers.
  [[nodiscard]] Eigen::VectorXd shifts_mm(const Eigen::VectorXd& coefficients) const;
  /// A tag's first unknown, and the derivatives of its plane_mm by the three.
  [[nodiscard]] Eigen::Index first_unknown(size_t tag) const { return of_a_set * set_of_[tag]; }
  [[nodiscard]] const Eigen::Vector3d& derivatives(size_t tag) const { return by_[tag]; }
  /// The part of its slice that a tag lies in, a quarter each way: what is wrong with an image - a ghost, a fold - is alike there.
  [[nodiscard]] int patch(size_t tag) const;

 private:
  Eigen::Index sets_ = 0;
  std::vector<Eigen::Index> set_of_;  // of each tag
  std::vector<Eigen::Vector3d> by_;   // of each tag
};

}  // namespace diastole
