#pragma once
// A diffusion-weighted series as volumes: one for each weighting (b-matrix) and repetition, one image of it a slice.

#include <Eigen/Dense>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/dicom/dicom_file.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/io/finding.hpp"

namespace diastole::imaging {

struct DiffusionVolume {
  Eigen::Matrix3d b_matrix;  ///< s/mm², patient axes
  int repetition = 0;        ///< from 0: of equal weightings
  /// A slice each; nothing where the image is missing or left out.
  std::vector<std::optional<Image>> images;

  [[nodiscard]] double b_s_mm2() const { return b_matrix.trace(); }
  /// The main axis of the weighting; its sign has no meaning.
  [[nodiscard]] Eigen::Vector3d direction() const;
  /// "b 1000 along (0.19, -0.96, -0.23)"; "b 0".
  [[nodiscard]] std::string name() const;
};

struct DiffusionSeries {
  std::string name;  ///< "series 4", "dwi.nii.gz"
  /// Columns: the axes along which a gradient table may be flipped besides the patient's: along rows, along columns, normal.
  Eigen::Matrix3d image_axes;
  /// Columns: the axes along which the table's numbers were read, those of the patient unless it is a .bvec.
  Eigen::Matrix3d table_axes = Eigen::Matrix3d::Identity();
  std::vector<SlicePlane> slices;
  double thickness_mm = 0;  ///< of what a voxel averages over
  std::vector<DiffusionVolume> volumes;
  std::string
      encoding;  ///< where weightings come from: "b-matrix", "b value and direction", "NAME.bval, NAME.bvec"
  std::vector<Finding> findings;

  /// Weightings above this are diffusion weighted; below, what imaging gradients leave in b = 0 images.
  static constexpr double unweighted_s_mm2 = 50;
  [[nodiscard]] std::vector<double> b_values() const;  ///< rounded to 10 s/mm², ascending, those that occur
  [[nodiscard]] std::vector<Eigen::Vector3d> directions() const;  ///< different ones, of weighted volumes
};

struct DiffusionRequest {
  std::optional<int> series = {};  ///< number, where there are several
};

/// Reads `folder` (DICOM, or NIfTI with .bval and .bvec). Throws InputError for files that are truncated or foreign, no diffusion
/// series, or several that do not share their slices. A missing image is a finding that names slice and weighting.
DiffusionSeries read_diffusion(const std::filesystem::path& folder, const DiffusionRequest& request = {},
                               const Progress& progress = {});

/// Throws InputError unless the volumes that every slice still has determine S0 and the six numbers of a tensor.
void require_tensor_scheme(const DiffusionSeries& series, const std::filesystem::path& folder);

}  // namespace diastole::imaging
