#pragma once
// What pixels say of a spline surface's coefficients.

#include <Eigen/Dense>
#include <array>

#include "estimator/imaging/tracking/spline_plane.hpp"

namespace diastole::imaging {

/// What the images of one phase say of the coefficients: exp(eta . c - c . H c / 2).
struct PhaseInformation {
  Eigen::MatrixXd precision;  ///< H, 1/mm^2
  Eigen::VectorXd vector;     ///< eta, 1/mm
};

/// The sums of  weight b b'  and  value b  over pixels, b their splines. Pixels that follow each other down one column of the image within one
/// cell of knots share the splines across: they are summed as products of the four splines down, a tenth of the work.
class PhaseInformationSum {
 public:
  explicit PhaseInformationSum(int splines);

  void add(const SplineValues& splines, double weight, double value);
  /// All that was added; ends the sum.
  PhaseInformation take();

 private:
  void end_run();

  PhaseInformation all_;     // the precision's lower triangle
  SplineValues run_{};       // cell and splines across of the pixels at hand
  Eigen::Matrix4d squares_;  // of splines down
  Eigen::Vector4d products_;
};

}  // namespace diastole::imaging
