#pragma once
// Where an image's pixels lie: DICOM patient coordinates (LPS, mm), PS3.3 C.7.6.2.1.1.

#include <Eigen/Dense>
#include <algorithm>
#include <string>

namespace diastole::imaging {

/// Pixel (column, row) has its centre at  origin + column * column_spacing * along_row + row * row_spacing * along_column.
struct SlicePlane {
  Eigen::Vector3d origin_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d along_row = Eigen::Vector3d::UnitX();     ///< unit; from one column to the next
  Eigen::Vector3d along_column = Eigen::Vector3d::UnitY();  ///< unit; from one row to the next
  double column_spacing_mm = 1.0;  ///< between columns: the second value of PixelSpacing
  double row_spacing_mm = 1.0;     ///< between rows: the first value of PixelSpacing
  int rows = 0;
  int columns = 0;
  double thickness_mm = 0.0;  ///< 0 where the file does not say

  [[nodiscard]] Eigen::Vector3d normal() const { return along_row.cross(along_column); }
  /// `in_plane_mm`: distances from the first pixel's centre along a row and along a column.
  [[nodiscard]] Eigen::Vector3d at(const Eigen::Vector2d& in_plane_mm) const {
    return origin_mm + in_plane_mm.x() * along_row + in_plane_mm.y() * along_column;
  }
  /// And back, of a place's foot in the plane.
  [[nodiscard]] Eigen::Vector2d in_plane_mm(const Eigen::Vector3d& place_mm) const {
    const Eigen::Vector3d from = place_mm - origin_mm;
    return {from.dot(along_row), from.dot(along_column)};
  }
  /// Column and row of the same, from the first pixel's centre.
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector3d& place_mm) const {
    return in_plane_mm(place_mm).cwiseQuotient(Eigen::Vector2d(column_spacing_mm, row_spacing_mm));
  }
  /// Along the normal.
  [[nodiscard]] double across_mm(const Eigen::Vector3d& place_mm) const {
    return normal().dot(place_mm - origin_mm);
  }
  [[nodiscard]] double finer_spacing_mm() const { return std::min(column_spacing_mm, row_spacing_mm); }
};

/// Same orientation, spacing and matrix: slices of one stack. Directions may differ by what 6 decimals round away.
bool parallel_alike(const SlicePlane& a, const SlicePlane& b);
/// As `parallel_alike`, and in the same place within a tenth of a pixel.
bool same_place(const SlicePlane& a, const SlicePlane& b);
/// "transverse", "sagittal, tilted 20 degrees": the anatomical plane nearest to the slice, in words.
std::string orientation_in_words(const SlicePlane& plane);

}  // namespace diastole::imaging
