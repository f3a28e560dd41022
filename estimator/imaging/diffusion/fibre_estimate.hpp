#pragma once
// A ventricle's fibre field from its diffusion tensors. In wall coordinates e_c, e_l, r (estimator/mesh/fibre_field.hpp) a tensor's deviator is
//
//   M = A (ffᵀ - 1/3) + B1 (ccᵀ - nnᵀ) + B2 (cnᵀ + ncᵀ)      f = cos γ (cos α e_c + sin α e_l) + sin γ r     helix α, transverse γ
//                                                           c = -sin α e_c + cos α e_l,  n = f x c
//
// α, γ, A, B1, B2 are fields over the lattice's nodes, tri-linear between: all five numbers of a deviator, and no sign of f anywhere. A
// voxel's model is the mean of QMQᵀ over what it averages over. Voxels at the wall's edge hold other material too: their size of M, between
// nothing changed and in proportion to the wall's share, is left open, its direction counts. Errors are the tensors' own covariances, scaled so
// that residuals fit, with Student's tails for voxels that fit no field (nu = 5).
//
// Smoothness: second differences along the lattice's lines, in the wall and through it apart, each of a strength that maximises the evidence
// (Wood and Fasiolo 2017, Biometrics 73:1071, the generalised Fellner-Schall update).

#include <Eigen/Dense>
#include <functional>
#include <string>
#include <vector>

#include "estimator/imaging/diffusion/wall_voxels.hpp"

namespace diastole::imaging {

struct FibreAngles {
  double helix_deg = 0;
  double transverse_deg = 0;
};

/// The field at one place.
struct FibreAt {
  Eigen::Vector3d direction;  ///< unit, patient axes; its sign has no meaning
  FibreAngles angles;
  double sigma_deg = 0;  ///< of the direction: root mean square angle
  double helix_sigma_deg = 0;
};

struct FibreEstimate {
  FibreLattice lattice;
  std::vector<FibreAngles> nodes;
  std::vector<std::vector<FibreAngles>> draws = {};  ///< of the posterior
  std::vector<double> anisotropy = {};               ///< A of each node, 1e-3 mm²/s
  size_t voxels = 0;
  double noise_scale = 1;  ///< residuals over what the tensors' covariances say, as standard deviations
  double rms_deg = 0;      ///< between voxels' first eigenvectors and the field's
  double freedom = 0;      ///< effective number of parameters
  int iterations = 0;
  bool converged = false;

  [[nodiscard]] FibreAt at(const MaterialPoint& point) const;
};

/// Precondition: `voxels` are of `lattice`. Throws InputError (in the name of `folder`) for too few of them.
FibreEstimate estimate_fibres(FibreLattice lattice, const std::vector<WallVoxel>& voxels,
                              const std::string& folder,
                              const std::function<void(const std::string&)>& stage = {});

}  // namespace diastole::imaging
