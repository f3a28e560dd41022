#pragma once
// What the tags of a frame can see of the body's motion, and what only smoothness fills in.
//
// Unseen share of the motion at a place, along the three directions on average: with u a priori white over the
// mesh's modes, each of 1 mm RMS over the body, and no smoothness at all,
//
//   share = tr Cov(u(X) | tags) / tr Cov(u(X))       1: the tags say nothing here,   0: they say all
//
// A mode whose standard error from the tags alone is 1 mm counts half. The number of modes seen is the sum of the
// same measure over the modes, tr[A (A + M/U²)⁻¹], U = 1 mm.
//
// Simple motions: shift, turn, stretch and shear of the whole body, each of 1 mm RMS; `affine_modes` gives the principal
// directions of what the tags know of these twelve, worst first, so that "nothing knows the shift along z" is said.

#include "estimator/reconstruction/frame_field.hpp"

namespace diastole {

inline constexpr double mode_amplitude_mm = 1.0;  // U
inline constexpr size_t element_probes = 8;

struct ElementCoverage {
  size_t rows = 0;            ///< measured numbers in the element
  Eigen::Vector3d weakest;    ///< direction in which their normals know least
  double weakest_rows = 0.0;  ///< how many numbers' worth they know along it
  double se_mm = 0.0;         ///< of a component of u, smoothness included, RMS over the element
  double unseen = 0.0;        ///< share, mean over the element
  std::array<double, element_probes> probe_se_mm;  ///< at (1 ∓ 1/√3)/2 in each direction, corner order
  std::array<double, element_probes> probe_unseen;
};

struct AffineMode {
  std::string words;   ///< "shift along z" or "shift along x and stretch along z"
  double se_mm = 0.0;  ///< RMS over the body, if the other modes were known; infinite when nothing is seen
  Eigen::Vector3d along = Eigen::Vector3d::Zero();  ///< shares of its motion along x, y and z; they sum to 1
};

struct Coverage {
  std::vector<ElementCoverage> elements;
  size_t modes = 0;  ///< unknowns of the field
  double modes_seen = 0.0;
  std::vector<AffineMode> affine_modes;
};

/// Tri-linear through the values at the probes, held to their range beyond them.
double between_probes(const std::array<double, element_probes>& values, const Xi& xi);

Coverage coverage_of(const FieldForms& forms, const FrameField& field);

}  // namespace diastole
