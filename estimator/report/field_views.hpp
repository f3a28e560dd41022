#pragma once
// Residuals of tags or points seen on the wall: unrolled, in layers from inside to outside, and across the axis.

#include <array>
#include <string>
#include <vector>

#include "estimator/explain/explanation.hpp"
#include "estimator/report/heat_map.hpp"

namespace diastole::report {

struct FieldView {
  std::string title;       ///< "inner third of the wall"
  CellGrid before, after;  ///< root mean square of the residuals in a cell, in sigmas: 1 where noise is all
  std::array<double, 2> y_range{};  ///< top, bottom
  std::string y_label;
};

/// Angles from -180 to 180 degrees across. First the layers over z, then the depth in the wall around the z at which the
/// cells of `before` are worst. Cells of fewer than four residuals are left out. Precondition: not empty.
std::vector<FieldView> field_views(const std::vector<explain::FieldResidual>& residuals);

/// Root mean square over all, of `before` and `after`.
std::array<double, 2> rms_of(const std::vector<explain::FieldResidual>& residuals);

}  // namespace diastole::report
