#pragma once
// A reconstruction as `diastole reconstruct --json` prints it and `-o NAME.json` keeps it for `diastole report` (format
// "diastole-reconstruction", format_version 1). Lengths in mm, pressures in kPa, times in s. A number that does not
// exist is NaN here and null in JSON; an infinite one likewise.

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/io/finding.hpp"
#include "estimator/io/solution_file.hpp"

namespace diastole {

inline constexpr std::string_view reconstruction_file_mark = "diastole-reconstruction";

struct ReconstructedFrame {
  int frame = 0;
  double time_s = 0.0;
  double pressure_kPa = 0.0;
  size_t rows = 0;       ///< measured numbers: one a tag point, three a 3-D point
  size_t wild = 0;       ///< of them left out
  size_t not_found = 0;  ///< points outside the moved wall
  double lambda = 0.0;
  bool lambda_at_edge = false;
  double degrees_of_freedom = 0.0;
  double chi2_per_dof = 0.0;
  double residual_spread = 0.0;  ///< robust, in units of sigma_mm
  double rms_mm = 0.0;           ///< of the residuals
  double motion = 0.0;           ///< along the last frame's motion, which is 1
  double motion_se = 0.0;
  double largest_displacement_mm = 0.0;
  double mean_se_mm = 0.0;    ///< of a component, RMS over the sampled points
  double sigma_factor = 1.0;  ///< sigma_mm of the written points / their standard error
  double volume_ratio = 1.0;  ///< of the body
  double volume_ratio_se = 0.0;
  double volume_error_rms = 0.0;  ///< J - 1 over the body
  double volume_error_p95 = 0.0;
  double volume_error_largest = 0.0;
  bool settled = false;
};

struct ReconstructedFamily {
  std::array<double, 3> normal{};
  size_t rows = 0;
  double chi2_per_dof = 0.0;
  std::vector<double> by_frame;  ///< in the order of the frames
};

struct ReconstructedSlice {
  std::string where;
  size_t rows = 0;
  double offset_mm = 0.0;
  double se_mm = 0.0;
  bool displaced = false;
};

struct ReconstructedElement {
  size_t element = 0;
  size_t rows = 0;
  std::array<double, 3> weakest_direction{};
  double weakest_rows = 0.0;
  double se_mm = 0.0;
  double unseen = 0.0;  ///< share of the motion that the tags say nothing about
  double volume_ratio = 1.0;
  double volume_ratio_se = 0.0;
};

struct ReconstructedMode {
  std::string words;
  double se_mm = 0.0;
};

struct CrossValidationCurve {
  int frame = 0;
  std::vector<double> lambda;
  std::vector<double> score;
  std::vector<double> degrees_of_freedom;
};

struct ReconstructionRecord {
  std::string study;
  std::string data;  ///< "tags", "points", "tags and points"
  std::vector<int> mesh;
  size_t unknowns = 0;
  std::array<double, 3> smoothing{};  ///< w1, w2, L in mm
  size_t points_a_frame = 0;
  std::vector<Finding> findings;
  std::vector<ReconstructedFrame> frames;
  std::vector<ReconstructedFamily> families;
  std::vector<ReconstructedSlice> slices;
  std::vector<ReconstructedElement> elements;  ///< of the last frame
  double modes_seen = 0.0;
  std::vector<ReconstructedMode> simple_motions;  ///< what the tags know least first
  std::vector<CrossValidationCurve> curves;
  std::vector<double> residual_edges;  ///< histogram of residuals / sigma, all frames
  std::vector<double> residual_counts;
  double seconds = 0.0;
  std::vector<SolutionSection> sections;  ///< of the last frame
};

std::string to_json(const ReconstructionRecord& record, bool with_sections = true);

/// Whether text is such a record, by its format.
bool is_reconstruction(std::string_view text);
/// Throws InputError (file, problem, remedy) unless it is a whole one; `file` stands for it in messages.
ReconstructionRecord reconstruction_record_from_json(std::string_view text, const std::string& file);

}  // namespace diastole
