#pragma once
// A fitted ventricle for its page: measures of every phase, slices, and sections with the points that were set. Plain data.

#include <string>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

struct VentriclePhaseRecord {
  int phase = 0;
  double cavity_mL = 0, cavity_sigma_mL = 0, wall_mL = 0;
  double thickness_mm = 0, least_thickness_mm = 0, most_thickness_mm = 0;
  double rms_mm = 0;
};

struct VentricleSliceRecord {
  std::string slice;
  bool is_reference = false;
  double shift_mm = 0, sigma_mm = 0;
};

/// A half-turn about the long axis: distance from it (negative on one side) and height, in mm.
struct VentricleSectionRecord {
  std::string title;
  std::vector<double> inner_r, inner_z, outer_r, outer_z;  ///< the mesh's phase, from base to base
  std::vector<double> small_r, small_z;  ///< the endocardium when the cavity is smallest; empty: the same
  std::vector<double> inner_point_r, inner_point_z, outer_point_r,
      outer_point_z;  ///< set in the slice nearest to it
};

struct VentricleRecord {
  std::string source;
  int phase = 0;  ///< of the mesh and the sections
  double ejection = 0, ejection_sigma = 0;
  double noise_factor = 1, rms_mm = 0;
  std::vector<VentriclePhaseRecord> phases;
  std::vector<VentricleSliceRecord> slices;
  std::vector<VentricleSectionRecord> sections;
  std::vector<Finding> findings;
};

}  // namespace diastole
