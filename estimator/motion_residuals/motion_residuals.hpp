#pragma once
// Residuals of tags and 3-D points against a moving body, in their standard deviations, and their derivatives.
//
//   tag point   s / sigma                    one row (tag_match.hpp)
//   3-D point   (x_seen - x(X)) / sigma      three rows, x y z
//
// Rows: frame after frame (each a slot), in each the tags in their order, then the points. Which of them count is decided by
// `find` in the motions given to it, and stays until the next call, so that the cost is a smooth function of the unknowns.
//
// A wild tag near the edge of the body may be lost in another motion: its line of error no longer meets its plane there
// (and a point may leave another undeformed mesh). It then keeps the residual that it had when it was found, with
// derivatives of zero, so that no single one can forbid a motion. A motion in which more than a tenth of a frame's tags, or
// of its points, are lost is too far off: it is refused.
//
// A change dx of the deformed and dX of the undeformed positions at fixed mesh coordinates changes a residual by
// by_motion . (dx - F dX).

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {

/// A tag seen farther outside the body than this (measured on the undeformed body) is not the specimen's.
inline constexpr double farthest_outside_mm = 5.0;

struct ResidualRow {
  size_t slot = 0;
  size_t source = 0;           ///< index in the measurement's tags, or their number + index in its points
  Eigen::Index component = 0;  ///< of a 3-D point
  double sigma_mm = 1.0;
  MaterialPoint point{};
  Eigen::Vector3d X_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d by_motion = Eigen::Vector3d::Zero();     ///< of the residual; zero while lost
  Eigen::Vector3d by_reference = Eigen::Vector3d::Zero();  ///< - F^T by_motion
  MaterialPoint found_point{};                             ///< in the motion of `find`
  double found_residual = 0.0;                             ///< likewise
  bool was_lost = false;                                   ///< in some motion since
};

/// Numbers of tags and points, after `find`.
struct FoundPoints {
  size_t usable = 0;
  size_t tags_left_out = 0;
  size_t tags_unfollowed =
      0;  ///< of those: on the body, but with a line of error that does not meet their plane there
  size_t points_left_out = 0;
};

/// exactly: each tag is matched anew, from where `find` found it: its residual depends on the motion alone, not on those tried before, even
/// where a wild tag has two places. closely: one step of that search from where the tag was, right to second order in the
/// change since the last motion; exact where that is large.
enum class Following { exactly, closely };

/// The frames after the undeformed frame 0 that have tags or points, in order.
std::vector<int> loaded_frames(const Measurement& measurement);

std::vector<const NodeField*> pointers_to(std::span<const NodeField> fields);

class MotionResiduals {
 public:
  /// The slots are these frames.
  MotionResiduals(const Measurement& measurement, std::vector<int> frames, LocatorOptions locator);

  /// The rows of several, slot after slot. Precondition: they are of one measurement.
  [[nodiscard]] static MotionResiduals joined(const std::vector<const MotionResiduals*>& parts);

  [[nodiscard]] const std::vector<int>& frames() const { return frames_; }
  [[nodiscard]] bool of_tag(const ResidualRow& row) const { return row.source < tags_.size(); }

  /// Moves the tags' planes by so much (one number a tag of the measurement, mm) from where the measurement has them; felt by the next
  /// `find` or `follow`.
  void shift_planes(const Eigen::VectorXd& by_mm);

  /// Looks for every point on the body in these motions, one a slot; returns how many tags became usable that were not.
  /// `reference` locates points of the undeformed mesh.
  size_t find(const HermiteMesh& mesh, const PointLocator& reference, std::span<const NodeField> position_mm);
  [[nodiscard]] const FoundPoints& found() const { return found_; }

  /// Residuals in other motions, or on another mesh of the same topology. False if one is refused: then nothing has changed.
  [[nodiscard]] bool follow(const HermiteMesh& mesh, const PointLocator& reference,
                            std::span<const NodeField> position_mm, Following how = Following::exactly);
  /// Leaves the tags that were lost since the last `find` out for good, from the next one on; how many.
  size_t give_up_lost();

  [[nodiscard]] const std::vector<ResidualRow>& rows() const { return rows_; }
  [[nodiscard]] Eigen::Index first(size_t slot) const { return first_[slot]; }
  [[nodiscard]] Eigen::Index count(size_t slot) const { return first_[slot + 1] - first_[slot]; }
  [[nodiscard]] Eigen::Index size() const { return first_.back(); }
  /// Of the last motion that was not refused.
  [[nodiscard]] const Eigen::VectorXd& residuals() const { return residuals_; }
  [[nodiscard]] Eigen::VectorXd sigmas_mm() const;

  /// Derivatives of a slot's residuals: a column a field of dx; `reference`: of dX, null where it is zero.
  [[nodiscard]] Eigen::MatrixXd columns(size_t slot, const HermiteMesh& mesh,
                                        std::span<const NodeField* const> motion,
                                        std::span<const NodeField* const> reference = {}) const;
  /// Derivatives of all residuals by fields that move each slot, times its factor.
  [[nodiscard]] Eigen::MatrixXd columns(const HermiteMesh& mesh, std::span<const NodeField> motion,
                                        std::span<const double> factors) const;
  /// Derivative of a row's residual by its tag's plane_mm, 1/mm.
  [[nodiscard]] double by_plane(const ResidualRow& row) const;
  /// The same rows at the same places of another undeformed mesh, for `columns` there; places outside it count nothing.
  [[nodiscard]] MotionResiduals relocated(const PointLocator& reference) const;

 private:
  void find_tags(size_t slot, const HermiteMesh& mesh, const PointLocator& reference,
                 const NodeField& position_mm);
  void find_points(size_t slot, const HermiteMesh& mesh, const PointLocator& reference,
                   const NodeField& position_mm);
  [[nodiscard]] bool few_are(const std::vector<unsigned char>& lost) const;

  std::vector<int> frames_;
  std::vector<TagPoint> tags_;
  std::vector<double> planes_mm_;  // of the measurement
  std::vector<ObservedPoint> points_;
  LocatorOptions locator_;
  std::vector<bool> given_up_;  // of tags_
  FoundPoints found_;
  std::vector<ResidualRow> rows_;
  std::vector<Eigen::Index> first_;
  Eigen::VectorXd residuals_;
};

}  // namespace diastole
