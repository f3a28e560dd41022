#pragma once
// Whether a gradient table's axes are those of the images: a flipped or exchanged axis turns every fibre the same wrong way, so that
// fibres at one depth of the wall no longer agree when they are seen in the wall's own coordinates.
//
//   agreement(P) = sum over depths of n |M|² (1 - f_r²) / sum of |D|²     M = mean of QᵀPDPᵀQ, f its first eigenvector
//
// D is a voxel's deviator, Q its wall axes; 1 - f_r² because fibres run in the wall: turned about the ventricle's axis they would agree as well. So
// it goes over the 24 signed permutations P (signs up to a common one, which no tensor sees), along the patient's axes and, where these are
// others, along the image's. A flip along the ventricle's
// long axis agrees almost as well as the truth: only the hand of the helix differs, which falls from inside to outside in all mammals.

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/diffusion/wall_voxels.hpp"
#include "estimator/io/finding.hpp"

namespace diastole::imaging {

struct AxisCandidate {
  Eigen::Matrix3d change = Eigen::Matrix3d::Identity();  ///< of directions, patient axes
  std::string name;      ///< "as the headers say", "x reversed", "x and z exchanged", "image rows reversed"
  double agreement = 0;  ///< 0 ... 1
  double helix_slope_deg = 0;  ///< helix angle outside - inside; negative in a heart
};

struct AxisCheck {
  std::vector<AxisCandidate> candidates;  ///< by agreement, best first
  AxisCandidate as_said, chosen;
  bool informative = false;  ///< some candidate agrees better than chance
  bool is_wrong = false;     ///< the headers' axes are contradicted: `chosen` is another
  std::vector<Finding> findings;
};

/// What "x", "-y+x+z" or "as-said" on a command line means: a change of the headers' directions. Nothing if it is no such word.
std::optional<AxisCandidate> axis_change_named(const std::string& word);

AxisCheck check_axes(const std::vector<WallVoxel>& voxels, const Eigen::Matrix3d& image_axes);

/// Turns every tensor.
void change_axes(TensorImage& tensors, const Eigen::Matrix3d& change);

}  // namespace diastole::imaging
