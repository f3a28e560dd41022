#pragma once
// Whether a gradient table's axes are those of the images: a flipped or exchanged axis turns every fibre the same wrong way, so that
// fibres at one depth of the wall no longer agree when they are seen in the wall's own coordinates.
//
// The agreement (estimator/imaging/diffusion/wall_agreement.hpp) goes over the 24 signed permutations P (signs up to a common one, which no tensor sees),
// along the patient's axes and, where these are others, along the image's; and over tables whose numbers are along the patient's or the image's axes
// though they were read along the other ones. From the best of them, a turn by a few degrees
// (estimator/imaging/diffusion/gradient_turn.hpp). A flip along the ventricle's
// long axis agrees almost as well as the truth: only the hand of the helix differs, which falls from inside to outside in all mammals.
//
// A change that is itself poor beside what right tables reach, noise set aside, is not made: that the table is doubtful is all that is known.

#include <Eigen/Dense>
#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/diffusion/wall_voxels.hpp"
#include "estimator/io/finding.hpp"

namespace diastole::imaging {

struct AxisCandidate {
  Eigen::Matrix3d change = Eigen::Matrix3d::Identity();  ///< of directions, patient axes
  std::string name;            ///< "as the headers say", "x reversed", "x = z, y = y, z = x", "rows reversed"
  double agreement = 0;        ///< 0 ... 1
  double helix_slope_deg = 0;  ///< helix angle outside - inside; negative in a heart
};

struct AxisCheck {
  std::vector<AxisCandidate> candidates;  ///< by agreement, best first
  AxisCandidate as_said, chosen;
  bool informative = false;  ///< some candidate agrees better than chance
  bool is_wrong = false;     ///< the headers' axes are contradicted: `chosen` is another, that agrees
  bool is_doubtful = false;  ///< they are contradicted, and nothing is corrected
  std::vector<Finding> findings;
};

/// What "x", "-y+x+z" or "as-said" on a command line means: a change of the headers' directions. Nothing if it is no such word.
std::optional<AxisCandidate> axis_change_named(const std::string& word);

/// Columns are unit vectors, patient axes.
struct TableFrames {
  Eigen::Matrix3d image_axes;                                ///< along rows, along columns, normal
  Eigen::Matrix3d table_axes = Eigen::Matrix3d::Identity();  ///< that the table's numbers were read along
};

AxisCheck check_axes(const std::vector<WallVoxel>& voxels, const TableFrames& frames);

/// Turns every tensor.
void change_axes(TensorImage& tensors, const Eigen::Matrix3d& change);

}  // namespace diastole::imaging
