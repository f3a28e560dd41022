#pragma once
// Residuals of tag points and 3-D points in their standard deviations, and how they change with the motion.
//
//   tag point   s / sigma                       estimator/motion_residuals/tag_match.hpp
//   3-D point   (x_seen - x(X)) / sigma         three rows
//
// Which points count is decided once, by the first motion; a motion in which one of them cannot be followed is refused.
// A change dx of the deformed and dX of the undeformed positions at fixed mesh coordinates changes a residual by
// by_motion . (dx - F dX).

#include <Eigen/Dense>
#include <span>
#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole::explain {

struct FieldRow {
  size_t slot;             ///< of its loaded frame
  size_t source;           ///< index in the measurement's tags, or number of tags + index of its points
  Eigen::Index component;  ///< of a 3-D point; 0 for a tag
  MaterialPoint point;
  Eigen::Vector3d X_mm;
  Eigen::Vector3d by_motion;     ///< of the weighted residual
  Eigen::Vector3d by_reference;  ///< - F^T by_motion
};

class FieldRows {
 public:
  /// The loaded frames that have points are the slots, in order.
  FieldRows(const Measurement& measurement, LocatorOptions locator);

  [[nodiscard]] const std::vector<int>& frames() const { return frames_; }
  [[nodiscard]] const std::vector<FieldRow>& rows() const { return rows_; }
  /// Rows of one slot are consecutive.
  [[nodiscard]] Eigen::Index first(size_t slot) const { return first_[slot]; }
  [[nodiscard]] Eigen::Index count(size_t slot) const { return first_[slot + 1] - first_[slot]; }
  [[nodiscard]] Eigen::Index size() const { return first_.back(); }
  [[nodiscard]] const Eigen::VectorXd& residuals() const { return residuals_; }
  [[nodiscard]] size_t left_out() const { return left_out_; }

  /// Looks for all points in these motions, one a slot.
  void find(const HermiteMesh& mesh, const PointLocator& reference, const std::vector<NodeField>& seen_mm);
  /// Residuals in other motions, or on another mesh of the same topology: right to second order in the change since the
  /// last call, exact where that is large. False when a point cannot be followed: then nothing has changed.
  [[nodiscard]] bool follow(const HermiteMesh& mesh, const PointLocator& reference,
                            const std::vector<NodeField>& seen_mm);
  /// The same rows at the same places of another undeformed mesh, for `columns` there; places outside it count nothing.
  [[nodiscard]] FieldRows relocated(const PointLocator& reference) const;

  /// A column a field of dx over a slot's rows; `reference`: of dX, null where it is zero.
  [[nodiscard]] Eigen::MatrixXd columns(size_t slot, const HermiteMesh& mesh,
                                        std::span<const NodeField* const> motion,
                                        std::span<const NodeField* const> reference = {}) const;

 private:
  void find_points(size_t slot, const HermiteMesh& mesh, const PointLocator& reference,
                   const NodeField& seen_mm);

  std::vector<TagPoint> tags_;
  std::vector<ObservedPoint> points_;
  LocatorOptions locator_;
  std::vector<int> frames_;
  std::vector<FieldRow> rows_;
  std::vector<Eigen::Index> first_;
  Eigen::VectorXd residuals_;
  size_t left_out_ = 0;
};

}  // namespace diastole::explain
