#pragma once
// The phase that still material shows: eddy currents and concomitant fields add a smooth field to every velocity. A polynomial in the plane is
// fitted to still material and taken off; its order is the one with the lowest Bayesian information criterion.

#include <Eigen/Dense>

#include "estimator/imaging/flow/moving_fluid.hpp"

namespace diastole::imaging {

struct BackgroundPhase {
  int order = 0;      ///< of the polynomial; -1: there is no still material, and nothing is taken off
  size_t pixels = 0;  ///< of still material
  double reduced_chi_square = 0;  ///< what the polynomial leaves, over the noise
  double at_lumen_rad = 0;        ///< its value at the origin
  double sigma_rad =
      0;  ///< standard error of that: noise, and what is left over an area as large as the lumen
  Eigen::Vector2d origin = {0, 0};  ///< of the polynomial, column and row
  double scale_px = 1;
  Eigen::VectorXd coefficients;  ///< 1, x, y, x^2, xy, y^2, ... of (place - origin) / scale

  [[nodiscard]] double at(double column, double row) const;
};

/// `lumen`: where the correction is wanted. Every pixel counts by its magnitudes; `still` as still_pixels gives it.
BackgroundPhase background_phase(const MotionMap& map,
                                 const Eigen::Array<bool, Eigen::Dynamic, Eigen::Dynamic>& still,
                                 const Eigen::Vector2d& lumen, double lumen_radius_px);

}  // namespace diastole::imaging
