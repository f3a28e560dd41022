#pragma once
// Where a diffusion image's voxels lie in a ventricle's wall. A voxel averages over its extent: a box through the slice's thickness
// and 1.2 pixels wide in the plane, the width at half height of what a Fourier transform of all lines makes of a point.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "estimator/imaging/diffusion/tensor_fit.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole::imaging {

/// The wall in coordinates of the images (patient, mm), and the same body on the finer mesh whose nodes carry the fibre field.
struct FibreLattice {
  HermiteMesh mesh;
  std::vector<double> depth;  ///< of each node: 0 inside, 1 outside
};

/// Halves elements until angles that are linear within them follow a ventricle's fibres: 16 around, 8 from apex to base, 4 through
/// the wall, where the mesh allows it.
FibreLattice fibre_lattice(const HermiteMesh& mesh);

/// One of the places that a voxel averages over.
struct WallSample {
  double share = 0;  ///< of what the voxel holds of the wall
  size_t element = 0;
  std::array<double, corners> basis{};  ///< tri-linear
  Eigen::Matrix3d axes;                 ///< columns e_c, e_l, r (estimator/mesh/fibre_field.hpp), patient
};

struct WallVoxel {
  const VoxelTensor* voxel = nullptr;
  std::vector<WallSample> samples;
  double fraction = 0;  ///< of its extent inside the wall
  double depth = 0;     ///< mean of the samples

  [[nodiscard]] const Eigen::Matrix3d& middle_axes() const { return samples[samples.size() / 2].axes; }
};

/// Those of which at least `least_fraction` lies in the wall. The result points into `tensors`.
std::vector<WallVoxel> wall_voxels(const FibreLattice& lattice, const DiffusionSeries& series,
                                   const TensorImage& tensors, double least_fraction = 0.5);

/// The same with each voxel's tensor that of its centre alone: of computed images, and of images resampled to voxels of no extent.
std::vector<WallVoxel> centre_voxels(const FibreLattice& lattice, const TensorImage& tensors);

}  // namespace diastole::imaging
