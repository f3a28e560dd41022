#include "estimator/reconstruction/study_reconstruction.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numeric>

#include "estimator/model/study_model.hpp"
#include "estimator/motion_residuals/motion_residuals.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "estimator/reconstruction/measurement_findings.hpp"
#include "estimator/reconstruction/stiffness_check.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double quick_settled_mm = 0.05;
constexpr double quick_fineness = 0.5;  // decades
constexpr int quick_huber_rounds = 2;

/// Extrapolation beyond an element as a fraction of the thinnest one: `farthest_outside_mm`, never more than an element.
LocatorOptions locator_for(const HermiteMesh& mesh) {
  double thinnest_mm = mesh.extent_mm();
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t k = 0; k < 3; ++k) {
      Xi low{0.5, 0.5, 0.5}, high = low;
      low[k] = 0.0;
      high[k] = 1.0;
      const double size_mm =
          (mesh.value(mesh.reference(), {e, high}) - mesh.value(mesh.reference(), {e, low})).norm();
      thinnest_mm = std::min(thinnest_mm, size_mm);
    }
  }
  return {.outside_xi = std::clamp(farthest_outside_mm / std::max(thinnest_mm, 1e-3), 0.25, 1.0)};
}

void reconstruct_frames(StudyReconstruction& result, const Measurement& measurement,
                        const std::vector<int>& frames, const ReconstructionOptions& options) {
  FrameOptions frame_options{
      .lambda = options.lambda, .robust = options.robust, .locator = locator_for(result.body->mesh)};
  if (options.quick) {
    frame_options.settled_mm = quick_settled_mm;
    frame_options.fineness = quick_fineness;
    frame_options.huber_rounds = quick_huber_rounds;
  }
  result.fields.resize(frames.size());
  std::mutex reporting;
  size_t done = 0;
  const auto reconstruct = [&](size_t i) {
    result.fields[i] = reconstruct_frame(*result.forms, measurement, frames[i], frame_options);
    const std::scoped_lock lock(reporting);
    if (options.on_frame) options.on_frame(++done, frames.size());
  };
  // Where one λ must do for all, the most loaded frame determines it best.
  std::optional<size_t> first;
  if (options.quick) {
    const auto most = std::ranges::max_element(frames, {}, [&](int frame) {
      return std::abs(measurement.frames[static_cast<size_t>(frame)].pressure_kPa);
    });
    first = static_cast<size_t>(most - frames.begin());
    reconstruct(*first);
    frame_options.lambda = result.fields[*first].smoothing.lambda;
  }
  parallel_for(frames.size(), machine_threads(), [&](size_t i) {
    if (i != first) reconstruct(i);
  });
}

void sample_fields(StudyReconstruction& result, const ReconstructionOptions& options) {
  double freedoms = 0.0;
  for (const FrameField& field : result.fields)
    freedoms = std::max(freedoms, sampled_freedoms(field));
  const size_t count = options.points_a_frame.value_or(static_cast<size_t>(std::ceil(freedoms / 3.0)));
  const std::vector<MaterialPoint> points = spread_points(*result.forms, count);
  for (const FrameField& field : result.fields)
    result.samples.push_back(sample_field(field, points));
}

void judge(StudyReconstruction& result, const Study& study, const Measurement& measurement,
           const ReconstructionOptions& options) {
  const FieldForms& forms = *result.forms;
  result.groups = group_tags(measurement.tags);
  result.amplitudes = motion_amplitudes(forms, result.fields, TagPlanes(measurement));
  result.families = family_fits(result.fields, result.groups, measurement.tags.size());
  result.slices = slice_offsets(result.fields, result.groups, measurement.tags);
  const auto motion = [](const FrameField& field) {
    return std::inner_product(field.displacement_mm.begin(), field.displacement_mm.end(),
                              field.displacement_mm.begin(), 0.0);
  };
  const FrameField& largest = *std::ranges::max_element(result.fields, {}, motion);
  for (const FrameField& field : result.fields)
    result.volumes.push_back(check_volume(forms, field, largest));
  if (!options.quick) result.coverage = coverage_of(forms, most_loaded(result.fields));
  const std::vector<Finding> found = motion_findings(result);
  result.findings.insert(result.findings.end(), found.begin(), found.end());
  if (!options.check_stiffness || has_error(result.findings)) return;
  if (const auto apparent = apparent_stiffness(study, forms, most_loaded(result.fields))) {
    if (const auto finding = pressure_unit_finding(study, *apparent)) result.findings.push_back(*finding);
  }
}

}  // namespace

StudyReconstruction reconstruct_study(const Study& study, const Measurement& measurement,
                                      const ReconstructionOptions& options) {
  const Clock::time_point begun = Clock::now();
  const std::vector<int> frames = loaded_frames(measurement);
  if (frames.empty()) {
    throw InputError({study.file.string(), "table [data]",
                      "every measured point is of frame 0, the undeformed state",
                      "Give points of loaded frames: only they have moved."});
  }
  StudyReconstruction result;
  result.body = std::make_unique<const MeshBody>(study_body(study));
  result.findings = measurement_findings(measurement, result.body->mesh);
  if (study.imaged_at)
    std::erase_if(result.findings, [](const Finding& f) { return f.id == "pressure-at-rest"; });
  if (!has_error(result.findings)) {
    result.forms = std::make_unique<const FieldForms>(result.body->mesh, options.smoothing);
    reconstruct_frames(result, measurement, frames, options);
    if (!options.quick) sample_fields(result, options);
    judge(result, study, measurement, options);
  }
  std::stable_sort(result.findings.begin(), result.findings.end(),
                   [](const Finding& a, const Finding& b) { return a.severity > b.severity; });
  result.seconds = std::chrono::duration<double>(Clock::now() - begun).count();
  return result;
}

std::vector<Finding> examine_measurement(const Study& study, const Measurement& measurement) {
  // The look settles no further than that, nor does its mesh follow a real motion more closely: sharper points would only be
  // fitted by what the data do not hold.
  Measurement looked_at = measurement;
  for (TagPoint& tag : looked_at.tags)
    tag.sigma_mm = std::max(tag.sigma_mm, quick_settled_mm);
  return reconstruct_study(study, looked_at, {.quick = true}).findings;
}

}  // namespace diastole
