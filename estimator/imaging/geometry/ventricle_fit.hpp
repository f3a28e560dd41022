#pragma once
// A ventricle's walls and base plane in every phase, from guide points.
//
// Walls: lambda(mu, theta) = sum of spherical harmonics (prolate_frame.hpp, wall_harmonics.hpp) for the middle of the wall
// and for its thickness. The coefficients of a phase are those that all phases have in common plus a departure. Of the common
// ones the variance falls with the degree l as a power, (l (l + 1) / 2)^-s; departures have one variance a degree for the
// order m = 0 and one for the others. All are those of the largest evidence, and so is the error of a click, as a factor on the
// file's sigmas. The base is a plane, likewise common plus departure.
//
// A point's residual is its distance from the wall along the normal; a click has its error in its image's plane, which counts by
// the share of the normal that lies in the plane, and across it the scatter of its slice (guide_slices.hpp).
//
// Breath holds: short-axis slices may be displaced in their planes, the same in all phases, by amounts whose variance is
// estimated, too. Long-axis slices define the reference; without two of them the mean displacement is not known and is zero.
// A slice whose points make no plane is not displaced, which is reported.
//
// Points farther than three sigmas from their wall pull with constant force (Huber), those beyond five are named; those that no
// ventricle passes are left out before (wild_points.hpp).

#include <string>
#include <vector>

#include "estimator/imaging/geometry/guide_points.hpp"
#include "estimator/imaging/geometry/guide_slices.hpp"
#include "estimator/imaging/geometry/prolate_frame.hpp"

namespace diastole::imaging {

struct VentricleOptions {
  bool estimate_shifts = true;
  std::vector<std::string> reference_slices = {};  ///< held in place; empty: the long-axis slices
};

/// Both walls and the base of one phase.
struct VentricleWalls {
  int phase = 0;                      ///< the file's number
  Eigen::VectorXd middle, thickness;  ///< harmonics of lambda
  Eigen::Vector3d base;               ///< plane z = b0 + b1 x + b2 y in the frame's axes
  Eigen::MatrixXd covariance;         ///< of middle, thickness and base, in this order
  double rms_mm = 0;                  ///< of the points' distances from their walls
  size_t points = 0;
};

struct SliceShift {
  std::string slice;
  bool is_reference = false;
  Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();  ///< the slice was seen displaced by this; patient axes
  double sigma_mm =
      0;  ///< of each of its two components in the plane; of a slice without points the others' spread
};

struct VentricleFit {
  ProlateFrame frame;
  std::vector<VentricleWalls> phases;
  std::vector<SliceShift> shifts;
  double rms_mm = 0;
  double noise_factor = 1;     ///< on the sigmas of the file
  double shift_spread_mm = 0;  ///< standard deviation of a component of the shifts, by evidence
  int iterations = 0;
  bool converged = false;
  std::vector<Finding> findings;
};

/// Throws InputError where the points do not make a ventricle.
VentricleFit fit_ventricle(const GuidePoints& guide, const VentricleOptions& options = {});

}  // namespace diastole::imaging
