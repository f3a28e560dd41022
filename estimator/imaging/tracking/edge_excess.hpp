#pragma once
// What the residuals hold beside noise near the tissue's edge.
//
// A matrix that is partly filled rings: some of what lies beyond an edge is seen several pixels within. That is weaker than noise, but the
// same in every phase, so that phases do not average it: a pixel with the excess e (in noise's variance) counts in T phases together as
// one with the variance 1 + T e in each.

#include <vector>

#include "estimator/imaging/tracking/tag_tracker.hpp"

namespace diastole::imaging {

class EdgeExcess {
 public:
  /// None anywhere.
  EdgeExcess() = default;
  /// By shells of half a pixel of depth, beside the deepest quarter of the fitted pixels; what two standard errors explain is none.
  EdgeExcess(const std::vector<TrackedPhase>& phases, double pixel_mm);

  /// By what a pixel's variance is multiplied.
  [[nodiscard]] double at(double depth_mm) const;

 private:
  double shell_mm_ = 1;
  std::vector<double> factors_;
};

}  // namespace diastole::imaging
