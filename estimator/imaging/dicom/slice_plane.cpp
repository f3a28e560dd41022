#include "estimator/imaging/dicom/slice_plane.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "protocol/contract/angle.hpp"

namespace diastole::imaging {
namespace {

/// Directions are written with six decimals or more, and vendors round them differently from file to file.
constexpr double direction_tolerance = 1e-4;
/// Spacings are written with five digits or more.
constexpr double spacing_tolerance = 1e-3;

bool close(double a, double b, double tolerance) { return std::abs(a - b) <= tolerance; }

}  // namespace

bool parallel_alike(const SlicePlane& a, const SlicePlane& b) {
  return a.rows == b.rows && a.columns == b.columns &&
         close(a.column_spacing_mm, b.column_spacing_mm, spacing_tolerance) &&
         close(a.row_spacing_mm, b.row_spacing_mm, spacing_tolerance) &&
         (a.along_row - b.along_row).norm() <= direction_tolerance &&
         (a.along_column - b.along_column).norm() <= direction_tolerance;
}

bool same_place(const SlicePlane& a, const SlicePlane& b) {
  return parallel_alike(a, b) && (a.origin_mm - b.origin_mm).norm() <= 0.1 * a.finer_spacing_mm();
}

std::string orientation_in_words(const SlicePlane& plane) {
  static constexpr std::array names = {"sagittal", "coronal", "transverse"};
  Eigen::Index axis = 0;
  const double along = plane.normal().cwiseAbs().maxCoeff(&axis);
  const double tilt_deg = std::acos(std::min(1.0, along)) / rad_per_deg;
  const char* name = names[static_cast<size_t>(axis)];
  return tilt_deg < 0.5 ? name : fmt::format("{}, tilted {:.0f} degrees", name, tilt_deg);
}

}  // namespace diastole::imaging
