#pragma once
// The joint least-squares problem of material values and frame pressures.
//
// A measured frame pressure has an error of its own, which a fit must not mistake for stiffness: each loaded
// frame's true pressure is an unknown with its measurement as a prior. With q = (values, pressures),
//
//   minimise  1/2 sum_frames |r_frame(values, P_frame)|^2  +  1/2 sum_frames ((P_frame + offset - measured) / sigma)^2
//             +  1/2 (offset / sigma_offset)^2  +  1/2 sum (tag planes / sigma_planes)^2  +  work and smoothness, below
//
// All measurements may be off by a common offset, one more unknown with a prior about zero; a pressure read in the
// undeformed frame 0 is a measurement of it. Tag planes that were found in images are unknowns too
// (estimator/motion_residuals/tag_planes.hpp).
// Where the body's shape was imaged under load (MotionModel::imaged_load), the pressure then is an unknown as a frame's is; frame 0 is
// that shape, and its reading says nothing of the offset.
// A frame with sigma_kPa = 0 has an exactly known pressure (but for the offset) and no unknown. A value with a positive lower
// bound enters as its logarithm (its error is closer to a factor than to a term); other values enter as they
// are.
//
// With a robust loss (robust_loss.hpp) the motion's residuals enter as u(r), and the cost changes with them.
// Parameters that vary by element may carry a smoothness prior (smoothness.hpp).
//
// A measured work of the pressure (work_energy.hpp) is one more residual, (U(x) - U(X) + offset dV - W) / sigma, U by the model.
//
// Residual rows: frame after frame (motion_residuals.hpp), then one for each unknown pressure, that of the imaged shape last, those of the offset, those of the tag
// planes, that of the work, then those of the smoothness priors.
// The points of frame 0 are not part of the problem: without load there is no information on stiffness.

#include <Eigen/Dense>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "estimator/fit/motion_model.hpp"
#include "estimator/fit/robust_loss.hpp"
#include "estimator/fit/smoothness.hpp"
#include "estimator/fit/work_energy.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"
#include "estimator/motion_residuals/tag_planes.hpp"

namespace diastole {

/// A value to be estimated, in the model's order; one that is positive within its bounds is searched by its logarithm.
/// Invariant: lower <= start <= upper, lower < upper.
struct EstimatedParameter : inference::Parameter {
  EstimatedParameter(double start_value, double lowest, double highest, std::string its_name = {},
                     std::string its_unit = {})
      : Parameter{std::move(its_name), std::move(its_unit), lowest, highest,
                  lowest > 0 ? inference::Scale::logarithmic : inference::Scale::linear},
        start(start_value) {}

  double start;
};

class JointProblem : public inference::LeastSquaresProblem {
 public:
  struct LoadedFrame {
    int number;
    Frame load;
    MotionResiduals residuals;  ///< of this one slot
    std::optional<Eigen::Index>
        pressure_unknown;   ///< its place in q; none when the pressure is exactly known
    NodeField position_mm;  ///< at the last `residuals` that found an equilibrium
  };

  /// `model` must outlive the problem. Frames without points are left out. `offset_sigma_kPa`: see above.
  JointProblem(MotionModel& model, const std::vector<EstimatedParameter>& values,
               const Measurement& measurement, LocatorOptions locator,
               std::optional<double> offset_sigma_kPa = {});

  /// Values, unknown pressures, offset, tag planes.
  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  [[nodiscard]] Eigen::Index unknowns() const { return space_.size(); }
  [[nodiscard]] Eigen::Index values() const { return values_; }
  /// Residuals: those of the data (pressures' priors included) come first.
  [[nodiscard]] Eigen::Index rows() const { return data_rows() + smooth_rows(); }
  [[nodiscard]] Eigen::Index data_rows() const;
  [[nodiscard]] const Eigen::VectorXd& start() const { return start_; }
  [[nodiscard]] const std::vector<LoadedFrame>& frames() const { return frames_; }
  /// The frames' pressures at q.
  [[nodiscard]] std::vector<double> pressures_at(const Eigen::VectorXd& q) const;
  /// Place in q of the pressures' common offset (measured less true), if there is one.
  [[nodiscard]] std::optional<Eigen::Index> offset_unknown() const { return offset_unknown_; }

  /// Place in q of the pressure at which the shape was imaged, if it is not exactly known.
  [[nodiscard]] std::optional<Eigen::Index> imaged_unknown() const { return imaged_unknown_; }
  /// That pressure. Precondition: the shape was imaged under load.
  [[nodiscard]] double imaged_pressure_at(const Eigen::VectorXd& q) const;
  [[nodiscard]] bool was_imaged_loaded() const { return imaged_.has_value(); }

  /// The tag planes are the last unknowns; how many.
  [[nodiscard]] Eigen::Index plane_unknowns() const { return planes_.unknowns(); }

  /// Of each row of the motion (TagPlanes::patch); -1 for a point that is none of a tag. Empty where the planes are exactly known.
  [[nodiscard]] std::vector<int> patches() const;

  /// What one standard deviation of each considered error changes in the residuals: a column over the rows. Precondition: as for jacobian.
  struct ConsideredColumn {
    std::string source;
    Eigen::VectorXd column;
  };
  [[nodiscard]] std::vector<ConsideredColumn> considered_columns();

  /// Derivatives by an offset, for a problem without that unknown: its column of `plain_jacobian`. Precondition as
  /// there.
  [[nodiscard]] Eigen::VectorXd offset_column();
  /// The load of frame 0 where it was measured: a sigma, and a pressure other than exactly 0.
  [[nodiscard]] const std::optional<Frame>& rest_reading() const { return rest_reading_; }

  /// A work that was measured; none at first. Changes `rows`. Precondition: it is of a frame of the problem, and the model has an energy.
  void set_work(std::optional<MeasuredWork> work);
  [[nodiscard]] const std::optional<MeasuredWork>& work() const { return work_; }
  /// What the model's body has stored then. Precondition: there is a work, and `residuals` succeeded.
  [[nodiscard]] double stored_energy_mJ() { return model_.stored_energy_mJ(work_slot()); }

  /// The priors of smooth blocks of values; none at first. Changes `rows`.
  void set_smoothness(std::vector<SmoothBlock> blocks);
  [[nodiscard]] const std::vector<SmoothBlock>& smoothness() const { return smooth_; }

  /// The loss of the motion's residuals; the normal's at first.
  void set_robust(std::optional<RobustLoss> loss);
  [[nodiscard]] const std::optional<RobustLoss>& robust() const { return robust_; }
  /// What is added to the motion's residuals whatever the unknowns are, frame after frame: what the model's mesh gets wrong. None at
  /// first, and none again after another `find_points`.
  void set_correction(Eigen::VectorXd correction);
  /// The motion's residuals in their stated standard deviations, of the last successful `residuals`, frame after
  /// frame.
  [[nodiscard]] Eigen::VectorXd motion_residuals() const;

  /// Solves all frames at q and chooses the usable points there; returns how many were gained, or nothing
  /// (and `failure`) without equilibrium.
  std::optional<size_t> find_points(const Eigen::VectorXd& q);

  /// Leaves the tags that were lost since the last `find_points` out of the next one and all later ones; how many.
  size_t give_up_lost();

  /// Residuals at q; nothing (and `failure`) if a frame has no equilibrium or many tags are lost there
  /// (motion_residuals.hpp).
  [[nodiscard]] std::optional<Eigen::VectorXd> residuals(const Eigen::VectorXd& q) override;
  /// Derivatives at q, by the model's exact sensitivities. Precondition: `residuals(q)` succeeded just
  /// before.
  [[nodiscard]] Eigen::MatrixXd jacobian(const Eigen::VectorXd& q) override;
  /// The same with the motion's residuals r instead of u(r).
  [[nodiscard]] Eigen::MatrixXd plain_jacobian(const Eigen::VectorXd& q);

  [[nodiscard]] std::string failure() const override { return failure_; }
  [[nodiscard]] int forward_solves() const { return forward_solves_; }

 private:
  [[nodiscard]] double offset_at(const Eigen::VectorXd& q) const;
  [[nodiscard]] double pressure_at(const LoadedFrame& frame, const Eigen::VectorXd& q) const;
  [[nodiscard]] Eigen::Index smooth_rows() const;
  /// A reading at rest counts only where the offset is estimated.
  [[nodiscard]] bool fits_rest() const { return offset_unknown_ && rest_reading_; }
  bool solve_frames(const Eigen::VectorXd& q);
  [[nodiscard]] size_t work_slot() const;
  /// d(work's residual)/dq, and its row.
  [[nodiscard]] Eigen::RowVectorXd work_derivatives(const Eigen::VectorXd& q);
  [[nodiscard]] Eigen::Index work_row() const { return data_rows() - 1; }
  void shift_planes(const Eigen::VectorXd& q);

  MotionModel& model_;
  Eigen::Index values_;
  inference::ParameterSpace space_;
  Eigen::VectorXd start_;
  std::unique_ptr<PointLocator> reference_;
  std::vector<LoadedFrame> frames_;
  std::optional<ImagedLoad> imaged_;
  std::optional<Eigen::Index> imaged_unknown_;
  std::optional<Eigen::Index> offset_unknown_;
  double offset_sigma_kPa_ = 0;
  std::optional<Frame> rest_reading_;
  TagPlanes planes_;
  std::optional<MeasuredWork> work_;
  std::vector<SmoothBlock> smooth_;
  std::optional<RobustLoss> robust_;
  Eigen::VectorXd correction_;  // of the motion's residuals; empty: none
  Eigen::VectorXd residuals_;
  std::optional<Eigen::VectorXd> solved_at_;     // where the frames' positions belong
  std::optional<Eigen::VectorXd> residuals_at_;  // where residuals_ belong
  std::string failure_;
  int forward_solves_ = 0;
};

}  // namespace diastole
