#pragma once
// Residuals of tags or points seen on the wall: unrolled, in layers from inside to outside, and across the axis.
//
// One tag shows little, the tags around a place show together whether the motion is off there. With r_i the residuals in
// sigmas, b_i their change by a motion u that the model lacks, and Gaussian weights w_i around the place (of a standard
// deviation of three tenths of the wall, some 8 mm of the paper's gel),
//
//   g = sum w_i b_i r_i,    V = sum w_i^2 b_i b_i^T,    shown: sqrt(g^T V^-1 g / 3)
//
// whose square is 1 on the average where there is noise alone, and grows with the square of u / its error elsewhere.

#include <array>
#include <string>
#include <vector>

#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/report/explanation_drawings.hpp"

namespace diastole::report {

struct FieldView {
  std::string title;                ///< "inner third of the wall"
  CellGrid before, after;           ///< misfit over noise, as above
  std::array<double, 2> y_range{};  ///< top, bottom
  std::string y_label;
  std::vector<std::array<double, 2>>
      marks;  ///< angle (degrees) and y of the marked places that lie in this view
};

/// Angles from -180 to 180 degrees across. First the layers over z, then the depth in the wall around the z at which the
/// cells of `before` are worst. Cells around which fewer than four residuals lie are left out. `marked_mm`: places of the
/// undeformed body to be marked. Precondition: not empty.
std::vector<FieldView> field_views(const std::vector<explain::FieldResidual>& residuals,
                                   const std::vector<std::array<double, 3>>& marked_mm = {});

/// Root mean square over all, of `before` and `after`.
std::array<double, 2> rms_of(const std::vector<explain::FieldResidual>& residuals);

}  // namespace diastole::report
