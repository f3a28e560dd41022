#pragma once
// `diastole reconstruct`: from a study's points to the displacement field of every loaded frame, what it is worth,
// and what is wrong with the data.
//
//   Study study = read_study(path);
//   StudyReconstruction result = reconstruct_study(study, read_measurement(study), {});
//   result.findings                          what the user should know first
//   result.fields[i].displacement_mm         in the order of the frames
//
// `examine_measurement` is the same, quickly, for a command that wants the findings only; the fast part by itself is
// measurement_findings.hpp.

#include <functional>
#include <memory>

#include "estimator/io/finding.hpp"
#include "estimator/io/study.hpp"
#include "estimator/mesh/mesh_file.hpp"
#include "estimator/reconstruction/field_samples.hpp"
#include "estimator/reconstruction/motion_findings.hpp"

namespace diastole {

struct ReconstructionOptions {
  SobolevWeights smoothing{};
  std::optional<double> lambda = {};  ///< instead of cross-validation
  bool robust = true;
  std::optional<size_t> points_a_frame =
      {};                       ///< default: as many as the fields have freedoms (field_samples.hpp)
  bool check_stiffness = true;  ///< one forward model, for the pressures' unit
  /// For the findings only: the most loaded frame's λ for all, found and settled less finely, no samples, no coverage.
  bool quick = false;
  std::function<void(size_t done, size_t of)> on_frame = {};
};

/// Without fields when the data cannot be what they say (an error among the findings of the measurement).
/// The coverage is empty if it was quick.
struct StudyReconstruction : MotionEvidence {
  std::unique_ptr<const MeshBody> body;
  std::vector<SampledFrame> samples;
  std::vector<Finding> findings;  ///< the gravest first
  double seconds = 0.0;
};

/// Throws InputError for a mesh file that is wrong, and if no loaded frame has a point.
StudyReconstruction reconstruct_study(const Study& study, const Measurement& measurement,
                                      const ReconstructionOptions& options);

/// Sound data give an empty list. Throws as above, and for studies that cannot be modelled.
std::vector<Finding> examine_measurement(const Study& study, const Measurement& measurement);

}  // namespace diastole
