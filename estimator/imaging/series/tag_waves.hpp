#pragma once
// Tag stripes in an image, found in its spectrum: a train of 90 degrees leaves the brightness
// a (1 - cos(2 pi (k . x - offset))) / 2 or, with binomial weights, a periodic function with its harmonics (Axel and
// Dougherty, Radiology 171 (1989) 841 and 172 (1989) 349), whose spectrum is a sharp peak at k.

#include <Eigen/Dense>
#include <numbers>
#include <vector>

#include "estimator/imaging/dicom/dicom_file.hpp"

namespace diastole::imaging {

struct TagWave {
  Eigen::Vector2d per_mm;  ///< wave vector k in cycles/mm, along a row and along a column of the image
  double
      offset_cycles;  ///< darkest where k . x - offset_cycles is an integer; x from the first pixel's centre, mm
  double modulation;  ///< 2 |F(k)| / F(0), 1 for full stripes
  double prominence;  ///< power at k over the median power at the same |k|

  [[nodiscard]] double spacing_mm() const { return 1.0 / per_mm.norm(); }
  /// At a place of the image: 0 on the darkest line of number 0.
  [[nodiscard]] double phase_rad(const Eigen::Vector2d& x_mm) const {
    return 2 * std::numbers::pi * (per_mm.dot(x_mm) - offset_cycles);
  }
};

/// The stripes of an image: none, one direction, or two of a grid. Their normals point along a row (x > 0), or along a
/// column where x is nothing. Harmonics of a direction, and a grid's sums and differences, are not directions.
std::vector<TagWave> find_tag_waves(const Image& image, const SlicePlane& plane);

/// How much of a wave is left in another image of the same slice: 2 |F(k)| / F(0) there.
double modulation_at(const Image& image, const SlicePlane& plane, const Eigen::Vector2d& per_mm);

}  // namespace diastole::imaging
