#pragma once
// The weighted residuals of one loaded frame, and their exact derivatives.
//
//   tag point      s / sigma                          one residual (tag_match.hpp)
//   3-D point      (x_seen - x(X)) / sigma            three residuals
//
// Rows: the usable tags in their order, then the usable points, x y z of each. A point is usable when it was
// found on the body at the motion given to `find_points`; the choice then stays until the next call, so that
// the cost is a smooth function of the unknowns.
//
// A wild tag near the edge of the body may be lost in another motion: its line of error no longer meets its plane
// there. It then keeps the residual that it had when it was found, with derivatives of zero, so that no single tag
// can forbid a motion. Only when many are lost the motion is too far off.

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "estimator/fit/motion_model.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/motion_residuals/tag_match.hpp"

namespace diastole {

/// A tag seen farther outside the body than this (measured on the undeformed body) is not the specimen's.
inline constexpr double farthest_outside_mm = 5.0;

class FrameResiduals {
 public:
  /// `mesh` and `reference` (its undeformed locator) must outlive this object.
  FrameResiduals(const HermiteMesh& mesh, const PointLocator& reference, std::vector<TagPoint> tags,
                 std::vector<ObservedPoint> points);

  /// Looks for every point on the body in this motion; returns how many became usable that were not.
  size_t find_points(std::span<const double> position_mm, const LocatorOptions& options);

  /// The residuals in this motion. False when more than a tenth of the usable tags are lost there.
  [[nodiscard]] bool evaluate(std::span<const double> position_mm);

  /// Leaves the tags that were lost since the last `find_points` out for good, from the next one on; how many.
  size_t give_up_lost();

  /// Of the last successful `evaluate`.
  [[nodiscard]] const Eigen::VectorXd& weighted() const { return weighted_; }
  [[nodiscard]] const Eigen::VectorXd& unweighted_mm() const { return unweighted_mm_; }
  /// d(weighted)/d(unknown), one column for each field of dx/d(unknown).
  [[nodiscard]] Eigen::MatrixXd derivatives(std::span<const NodeField* const> fields) const;

  [[nodiscard]] Eigen::Index rows() const { return weighted_.size(); }
  [[nodiscard]] size_t usable() const { return usable_tags_.size() + usable_points_.size(); }
  [[nodiscard]] size_t tags_left_out() const { return tags_.size() - usable_tags_.size(); }
  /// Of those left out: on the body, but with a line of error that does not meet their plane there.
  [[nodiscard]] size_t tags_unfollowed() const { return unfollowed_; }
  [[nodiscard]] size_t points_left_out() const { return points_.size() - usable_points_.size(); }

 private:
  struct UsableTag {
    size_t index;
    TagMatch match;
    double found_error_mm;  // the error in the motion of `find_points`
    bool was_lost = false;  // in some motion since
  };
  struct UsablePoint {
    size_t index;
    MaterialPoint point;
  };

  [[nodiscard]] std::vector<UsableTag> find_tags(std::span<const double> position_mm,
                                                 const LocatorOptions& options);

  const HermiteMesh& mesh_;
  const PointLocator& reference_;
  std::vector<TagPoint> tags_;
  std::vector<ObservedPoint> points_;
  std::vector<bool> given_up_;
  size_t unfollowed_ = 0;
  std::vector<UsableTag> usable_tags_;
  std::vector<UsablePoint> usable_points_;
  Eigen::VectorXd weighted_;
  Eigen::VectorXd unweighted_mm_;
};

}  // namespace diastole
