#pragma once
// Diffusion-weighted images of a body at rest whose fibres are known: slices across its z, one beside the other. Tissue diffuses along
// its fibres faster than across; all that is no tissue gives no signal. A pixel is the mean of its voxel,
//
//   S = mean over the voxel of exp(-b g . D g),   D = across I + (along - across) f f^T
//
// with complex noise, as magnitude. Nothing of this knows how tensors are fitted.

#include <Eigen/Dense>
#include <filesystem>
#include <functional>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"
#include "tools/sim_scanner/dicom_image.hpp"
#include "tools/sim_scanner/scanner.hpp"

namespace diastole::scanner {

struct DiffusionProtocol {
  double pixel_mm = 2.0;
  double thickness_mm = 6.0;
  double b_s_mm2 = 1000;
  int directions = 12;                     ///< over half of the sphere
  int unweighted = 2;                      ///< volumes without weighting before them
  double along = 1.3e-3, across = 0.8e-3;  ///< mm^2/s
  double snr = 20;                         ///< tissue without weighting over the noise of one channel
  int series = 20;                         ///< its number
  unsigned seed = 1;

  /// Of each volume, directions in patient coordinates.
  [[nodiscard]] std::vector<DiffusionLabel> weightings() const;
};

/// A unit vector in the body's axes.
using FibreAt = std::function<Eigen::Vector3d(const MaterialPoint&)>;

/// Writes dNNNN.dcm into the folder, which must exist.
ScannedSeries scan_diffusion(const HermiteMesh& mesh, const FibreAt& fibre, const DiffusionProtocol& protocol,
                             const ScanPose& pose, const std::filesystem::path& folder);

}  // namespace diastole::scanner
