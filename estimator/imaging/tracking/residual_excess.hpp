#pragma once
// What the residuals of a slice hold beside noise: near the tissue's edge, and where another picture lies over it.
//
// A matrix that is partly filled rings: some of what lies beyond an edge is seen several pixels within. A field of view that is too small folds,
// and the fold's stripes lie over a part of the tissue. Both are the same in every phase, so that phases do not average them: a pixel with the
// excess e (in noise's variance) counts in T phases together as one with the variance 1 + T e in each.

#include <Eigen/Core>
#include <vector>

#include "estimator/imaging/dicom/slice_plane.hpp"
#include "estimator/imaging/tracking/tracked_phase.hpp"

namespace diastole::imaging {

class ResidualExcess {
 public:
  /// None anywhere.
  ResidualExcess() = default;
  /// By squares of `square_mm` beside the typical one, and by shells of half a pixel of depth beside the deepest quarter of the fitted
  /// pixels, without what lies in squares that have an excess; what two standard errors explain is none.
  ResidualExcess(const std::vector<TrackedPhase>& phases, const SlicePlane& plane, double square_mm);

  /// Of a pixel's variance in one phase, over noise's.
  [[nodiscard]] double at(const TrackedPhase& phase, Eigen::Index row, Eigen::Index column) const;
  /// By what its variance is multiplied where all phases are fitted together.
  [[nodiscard]] double over_phases(const TrackedPhase& phase, Eigen::Index row, Eigen::Index column) const {
    return 1 + phases_ * at(phase, row, column);
  }
  /// Whether its square holds nothing but noise.
  [[nodiscard]] bool is_clean(Eigen::Index row, Eigen::Index column) const {
    return of_squares_.size() == 0 || of_square(row, column) == 0;
  }

 private:
  [[nodiscard]] double of_square(Eigen::Index row, Eigen::Index column) const {
    return of_squares_(row / rows_in_square_, column / columns_in_square_);
  }

  double phases_ = 1, shell_mm_ = 1;
  Eigen::Index rows_in_square_ = 1, columns_in_square_ = 1;
  Eigen::ArrayXXd of_squares_;
  std::vector<double> of_shells_;
};

}  // namespace diastole::imaging
