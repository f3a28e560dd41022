#pragma once
// A diffusion series of a ventricle whose fibres are known, written as DICOM or NIfTI: the thick ellipsoid of estimator/mesh/ellipsoid.hpp
// with a helix that is linear through the wall. Its geometry is stated here once more, so that reader and writer share nothing.

#include <Eigen/Dense>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace diastole::test {

enum class DiffusionTags { standard, b_matrix, siemens, none };

struct DiffusionScan {
  int pixels = 28;
  double pixel_mm = 2.5;
  double thickness_mm = 6;
  int slices = 12;
  double noise = 0;  ///< of a channel; the wall is 1000 without weighting
  DiffusionTags tags = DiffusionTags::standard;
  Eigen::Vector3d header_signs{1, 1, 1};  ///< what the headers make of directions
  /// And before: a table that was not turned with the images.
  Eigen::Matrix3d header_turn = Eigen::Matrix3d::Identity();
  double helix_around_deg = 0;  ///< the helix angle is so much larger on one side, and smaller on the other
  std::set<std::pair<int, int>> missing = {};  ///< (volume, slice) that no file holds
  std::set<std::pair<int, int>> faded = {};    ///< (volume, slice) that lost half of their signal
  std::set<int> absent_volumes = {};           ///< that are not there at all
  bool isotropic = false;
  bool second_shell = false;  ///< the same directions at b 2000 besides
  double kurtosis =
      0;  ///< ln S = -b D + K (b D)^2 / 6 (J. H. Jensen et al., Magn. Reson. Med. 53 (2005) 1432)
  double endo_deg = 60, epi_deg = -60;
  /// Columns: the ventricle's axes, patient coordinates; slices lie across the third.
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
  Eigen::Vector3d origin_mm{4, -7, 11};

  /// b (s/mm²) and direction of each volume: b = 0 twice, then 12 directions of b 1000, and those of a second shell.
  [[nodiscard]] std::vector<std::pair<double, Eigen::Vector3d>> volumes() const;
  /// At a place of the wall (patient coordinates); nothing outside.
  [[nodiscard]] std::optional<Eigen::Vector3d> fibre(const Eigen::Vector3d& place_mm) const;
  /// 1e-3 mm²/s, patient axes.
  [[nodiscard]] Eigen::Matrix3d tensor(const Eigen::Vector3d& place_mm) const;

  static constexpr double inner_mm = 21, inner_long_mm = 51, wall_mm = 9, base_mm = 15;
  static constexpr double along = 1.3, across = 0.8;  ///< diffusivities
};

/// Writes imNNN.dcm.
void write_dicom(const DiffusionScan& scan, const std::filesystem::path& folder);
/// Writes dwi.nii, dwi.bval and dwi.bvec.
void write_nifti(const DiffusionScan& scan, const std::filesystem::path& folder);

}  // namespace diastole::test
