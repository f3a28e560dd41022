#pragma once
// Cines of a heart put together: short- and long-axis slices by phase, and the axis that they lie about.
//
// Levels of blood, wall and surroundings are three classes of all slices' grey values. The short axis is the orientation that most slices
// have; the axis is the line in which long-axis planes meet, and goes from apex to base.

#include <Eigen/Dense>
#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "estimator/imaging/dicom/slice_plane.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/io/finding.hpp"

namespace diastole::imaging {

/// Grey values of the three materials.
struct GreyLevels {
  double around = 0, wall = 0, blood = 0;
  [[nodiscard]] double inner() const { return 0.5 * (blood + wall); }
  [[nodiscard]] double outer() const { return 0.5 * (wall + around); }
};

struct CineSlice {
  std::string name;
  SlicePlane plane;
  bool is_long = false;
  std::vector<Eigen::ArrayXXd> images;  ///< by phase; without pixels where the slice lacks it
  std::vector<double> times_ms;         ///< of the phases
  GreyLevels levels;

  [[nodiscard]] bool has(size_t phase) const { return images[phase].size() > 0; }
  [[nodiscard]] const Eigen::ArrayXXd& first_image() const {
    return *std::ranges::find_if(images, [](const Eigen::ArrayXXd& image) { return image.size() > 0; });
  }
};

struct Cines {
  std::filesystem::path folder;
  std::vector<CineSlice> slices;  ///< short-axis ones sa00 (apical) upwards, then long-axis ones la0 upwards
  std::vector<int>
      phases;  ///< those that some slice shows, by their numbers from 0 in the order of trigger time
  Eigen::Vector3d axis_point_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();  ///< unit, towards the base
  std::vector<Finding> findings;

  /// Where the axis crosses a short-axis slice; of a long-axis slice a point of the axis.
  [[nodiscard]] Eigen::Vector3d crossing_mm(const CineSlice& slice) const;
  /// Along the axis.
  [[nodiscard]] double height_mm(const Eigen::Vector3d& place_mm) const {
    return axis.dot(place_mm - axis_point_mm);
  }
};

/// Throws InputError where the folder is not sound or has fewer than three slices of cines.
Cines read_cines(const ImageFolder& folder);

}  // namespace diastole::imaging
