#pragma once
// The truth beside a labelled set of tagged images (truth.h5): where every tag plane's material really is in each phase.

#include <Eigen/Dense>
#include <filesystem>
#include <vector>

namespace diastole {

/// The tag planes of one series and direction: n . X = d + number * spacing, in the specimen's axes.
struct TrueFamily {
  Eigen::Vector3d normal;
  double d_mm;
  double spacing_mm;
};

/// A place on a visible tag line, every 4 mm.
struct TruePoint {
  size_t phase;
  size_t family;
  int number;
  Eigen::Vector3d x_mm;  ///< deformed, in the specimen's axes
};

struct ImagingTruth {
  bool is_ventricle = false;
  double pixel_mm = 1;  ///< the finer side
  std::vector<double> times_s;
  Eigen::Vector3d origin_mm;  ///< of the specimen's axes, in patient coordinates
  Eigen::Matrix3d axes;       ///< columns: the specimen's axes
  std::vector<TrueFamily> families;
  std::vector<TruePoint> points;

  // The motion, axisymmetric with a twist, on a grid of places (r, z): where the material there came from.
  std::vector<double> r_mm, z_mm;
  std::vector<std::vector<double>> R_mm, Z_mm, twist_rad;  ///< a phase: r slow, z fast

  /// X of the material that is seen at a place (specimen's axes) in a phase.
  [[nodiscard]] Eigen::Vector3d material_mm(size_t phase, const Eigen::Vector3d& x_mm) const;
  /// How deep in the wall a material point lies; negative outside. The gel is 22.5 to 50 mm by 85 mm, the ventricle that of the paper's Eq. 5.
  [[nodiscard]] double depth_mm(const Eigen::Vector3d& X_mm) const;
  /// Displacements at material points, in the specimen's axes: what grid/ holds.
  struct Displacements {
    std::vector<Eigen::Vector3d> X_mm;
    std::vector<std::vector<Eigen::Vector3d>> u_mm;  ///< a phase
  };
  Displacements grid;
};

/// Throws InputError for what is no such file.
ImagingTruth read_imaging_truth(const std::filesystem::path& file);

}  // namespace diastole
