#pragma once
// The displacement field of one frame, from its tag points (and 3-D points): Eq. 2 of the paper.
//
//   FieldForms forms(mesh, weights);
//   FrameField field = reconstruct_frame(forms, measurement, 5, options);
//   forms.space.mesh().value(field.displacement_mm, point)            mm, at a material point
//
// The unknown is u(X) on the undeformed mesh, x = X + u. A tag point gives one residual, its error s along the tag's
// normal (estimator/motion_residuals/tag_match.hpp); a 3-D point gives three. To first order in the change of u
//
//   s(u) = s(u0) − d · (u − u0)(X),        d = F⁻ᵀn / (n·F⁻¹n),
//
// so each round is a linear penalised problem (smoothed_system.hpp), and four or five rounds suffice. λ is chosen by
// cross-validation in the third round, where the linearisation is already good; before it is small, so that what a
// stiff field would miss is not taken for wild.
//
// Wild points: rounds begin with Huber's weights and go on with Tukey's (iteratively re-weighted, scale from the
// median absolute residual, so that a wrong sigma does not make every point wild). What then lies beyond
// five times their spread is left out and all else counts fully: the statistics are those of ordinary least squares again.

#include <memory>
#include <optional>
#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/reconstruction/cross_validation.hpp"

namespace diastole {

struct FrameOptions {
  std::optional<double> lambda;  ///< instead of cross-validation
  bool robust = true;            ///< leave wild points out
  LocatorOptions locator{};      ///< how far outside the body a point may lie
  double settled_mm = 1e-3;      ///< RMS: a round that moves the body by less is the last
  double fineness = 0.1;         ///< of the search for λ, decades
  int huber_rounds = 4;          ///< in the first round, from rest
};

struct FieldRow {
  bool of_tag;
  size_t source;           ///< index among the measurement's tags or points
  int component;           ///< of a 3-D point; 0 for a tag
  MaterialPoint point;     ///< X
  Eigen::Vector3d normal;  ///< the direction of motion that the row knows
  double sigma_mm;
  double residual;  ///< s / sigma
  bool rejected;
};

struct FrameField {
  int number = 0;
  Frame load{};
  NodeField displacement_mm;
  NodeField position_mm;
  CrossValidation smoothing;
  double degrees_of_freedom = 0.0;  ///< tr K, exact to its random signs
  double residual_freedom = 0.0;    ///< tr[(1 - K)²] over the rows used: what chi2() should be
  Eigen::VectorXd residual_shares;  ///< of each row (cross_validation.hpp); 0 of the rejected
  double scale = 0.0;               ///< spread of the residuals / sigma: 1 where sigma is right
  std::vector<FieldRow> rows;
  std::vector<size_t> tags_not_found;  ///< sources that lie nowhere on the moved body
  std::vector<size_t> points_not_found;
  int rounds = 0;
  bool converged = false;                  ///< the last round moved the body by less than `settled_mm`
  std::unique_ptr<SmoothedSystem> system;  ///< of the last round: covariances

  [[nodiscard]] size_t used() const;
  [[nodiscard]] double chi2() const;  ///< of the rows that were used
};

/// Precondition: the frame has a point. `forms` must outlive the result.
FrameField reconstruct_frame(const FieldForms& forms, const Measurement& measurement, int frame,
                             const FrameOptions& options);

/// Of the highest pressure: in images of a whole cycle the last frame is nearly at rest.
const FrameField& most_loaded(const std::vector<FrameField>& fields);

/// Standard deviation of normal numbers about zero, blind to a few wild ones (signal::deviation_of_normal); 0 of none.
double robust_spread(std::vector<double> values);

}  // namespace diastole
