#pragma once
// Guide points: places on a ventricle's walls, clicked or traced in images, in DICOM patient coordinates (LPS, mm).
//
//   NAME.guide.csv   phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm
//                    surface: endo, epi, base (the plane that closes the cavity), apex_endo, apex_epi; columns in
//                    any order; without sigma_mm all points have the same
//   biv-me's GPFile  x y z contour-type sliceID weight frame, by blanks or tabs, with or without the weight;
//                    frame counts from what the file says, slices are called by their number
//
// An error of `sigma_mm` is that of a coordinate in the image's plane: a point's place across the plane is the slice's.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole::imaging {

/// A click at an apex is one on its wall, and says which end the apex is.
enum class GuideSurface { endo, epi, base, apex_endo, apex_epi };

constexpr bool is_inner(GuideSurface surface) {
  return surface == GuideSurface::endo || surface == GuideSurface::apex_endo;
}
constexpr bool is_apex(GuideSurface surface) {
  return surface == GuideSurface::apex_endo || surface == GuideSurface::apex_epi;
}
std::string_view name_of(GuideSurface surface);
std::optional<GuideSurface> surface_named(std::string_view name);

struct GuidePoint {
  size_t phase = 0;  ///< index into GuidePoints::phases
  size_t slice = 0;  ///< index into GuidePoints::slices
  GuideSurface surface = GuideSurface::endo;
  Eigen::Vector3d place_mm = Eigen::Vector3d::Zero();
  double sigma_mm = 0;
};

struct GuidePoints {
  std::string file;
  std::vector<int> phases;  ///< as the file numbers them, rising
  std::vector<std::string> slices;
  std::vector<GuidePoint> points;
  std::vector<Finding> findings;  ///< what the file holds beside a left ventricle
};

/// Of a click, where nothing is stated.
inline constexpr double click_sigma_mm = 0.5;

inline constexpr std::string_view guide_file_mark = "phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm";

/// Throws InputError with file, line, value and remedy.
GuidePoints read_guide_points(const std::filesystem::path& path);
/// The same from text; `file` stands for it in messages. `default_sigma_mm`: of a GPFile's points of weight one, and where a
/// table has no sigma_mm; the fit finds the error's true size.
GuidePoints guide_points_from_text(std::string_view text, const std::string& file,
                                   double default_sigma_mm = click_sigma_mm);
/// Whether its first line is a table's, as guide_file_text writes one.
bool is_guide_table(std::string_view text);
std::string guide_file_text(const GuidePoints& points);

}  // namespace diastole::imaging
