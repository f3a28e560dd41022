#include "estimator/io/reconstruction_file.hpp"

#include "estimator/io/finding_json.hpp"
#include "estimator/io/record_file.hpp"
#include "estimator/io/section_json.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

DIASTOLE_MEMBERS(ReconstructedFrame, frame, time_s, pressure_kPa, rows, wild, not_found, lambda,
                 lambda_at_edge, degrees_of_freedom, chi2_per_dof, residual_spread, rms_mm, motion, motion_se,
                 largest_displacement_mm, mean_se_mm, sigma_factor, volume_ratio, volume_ratio_se,
                 volume_error_rms, volume_error_p95, volume_error_largest, settled)

DIASTOLE_MEMBERS(ReconstructedFamily, normal, rows, chi2_per_dof, by_frame)

DIASTOLE_MEMBERS(ReconstructedSlice, where, rows, offset_mm, se_mm, displaced)

DIASTOLE_MEMBERS(ReconstructedElement, element, rows, weakest_direction, weakest_rows, se_mm, unseen,
                 volume_ratio, volume_ratio_se)

DIASTOLE_MEMBERS(ReconstructedMode, words, se_mm)

DIASTOLE_MEMBERS(CrossValidationCurve, frame, lambda, score, degrees_of_freedom)

DIASTOLE_MEMBERS(ReconstructionRecord, study, data, mesh, unknowns, smoothing, points_a_frame, seconds,
                 findings, frames, families, slices, elements, modes_seen, simple_motions, curves,
                 residual_edges, residual_counts, sections)

namespace {

constexpr RecordFormat reconstruction_format{
    reconstruction_file_mark, "a reconstruction",
    "Give a file that `diastole reconstruct STUDY -o NAME.json` wrote."};

void require_lengths(const ReconstructionRecord& record) {
  for (const CrossValidationCurve& curve : record.curves) {
    if (curve.score.size() != curve.lambda.size() || curve.degrees_of_freedom.size() != curve.lambda.size())
      throw std::invalid_argument("a curve's lists differ in length");
  }
  for (const ReconstructedFamily& family : record.families) {
    if (family.by_frame.size() != record.frames.size())
      throw std::invalid_argument("a family has not one value a frame");
  }
  if (!record.residual_counts.empty() && record.residual_edges.size() != record.residual_counts.size() + 1)
    throw std::invalid_argument("residual_edges and residual_counts do not match");
}

}  // namespace

std::string to_json(const ReconstructionRecord& record, bool with_sections) {
  Json json = reconstruction_format.document(written(record));
  round_numbers(json["sections"], six_digits);
  if (!with_sections) json["sections"].clear();
  return json_text(json, with_sections ? -1 : 1) + "\n";
}

bool is_reconstruction(std::string_view text) { return reconstruction_format.marks(text); }

ReconstructionRecord reconstruction_record_from_json(std::string_view text, const std::string& file) {
  ReconstructionRecord record;
  reconstruction_format.read(text, file, [&](const Json& json) {
    read_json(json, record);
    require_sound(record.sections);
    require_lengths(record);
  });
  return record;
}

}  // namespace diastole
