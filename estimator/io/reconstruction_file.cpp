#include "estimator/io/reconstruction_file.hpp"

#include <fmt/format.h>

#include <stdexcept>

#include "estimator/io/finding_json.hpp"
#include "estimator/io/member_json.hpp"
#include "estimator/io/section_json.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {

template <class Visit, IsRecord<ReconstructedFrame> Record>
void each_member(Visit&& visit, Record& f) {
  visit("frame", f.frame);
  visit("time_s", f.time_s);
  visit("pressure_kPa", f.pressure_kPa);
  visit("rows", f.rows);
  visit("wild", f.wild);
  visit("not_found", f.not_found);
  visit("lambda", f.lambda);
  visit("lambda_at_edge", f.lambda_at_edge);
  visit("degrees_of_freedom", f.degrees_of_freedom);
  visit("chi2_per_dof", f.chi2_per_dof);
  visit("residual_spread", f.residual_spread);
  visit("rms_mm", f.rms_mm);
  visit("motion", f.motion);
  visit("motion_se", f.motion_se);
  visit("largest_displacement_mm", f.largest_displacement_mm);
  visit("mean_se_mm", f.mean_se_mm);
  visit("sigma_factor", f.sigma_factor);
  visit("volume_ratio", f.volume_ratio);
  visit("volume_ratio_se", f.volume_ratio_se);
  visit("volume_error_rms", f.volume_error_rms);
  visit("volume_error_p95", f.volume_error_p95);
  visit("volume_error_largest", f.volume_error_largest);
  visit("settled", f.settled);
}

template <class Visit, IsRecord<ReconstructedFamily> Record>
void each_member(Visit&& visit, Record& f) {
  visit("normal", f.normal);
  visit("rows", f.rows);
  visit("chi2_per_dof", f.chi2_per_dof);
  visit("by_frame", f.by_frame);
}

template <class Visit, IsRecord<ReconstructedSlice> Record>
void each_member(Visit&& visit, Record& s) {
  visit("where", s.where);
  visit("rows", s.rows);
  visit("offset_mm", s.offset_mm);
  visit("se_mm", s.se_mm);
  visit("displaced", s.displaced);
}

template <class Visit, IsRecord<ReconstructedElement> Record>
void each_member(Visit&& visit, Record& e) {
  visit("element", e.element);
  visit("rows", e.rows);
  visit("weakest_direction", e.weakest_direction);
  visit("weakest_rows", e.weakest_rows);
  visit("se_mm", e.se_mm);
  visit("unseen", e.unseen);
  visit("volume_ratio", e.volume_ratio);
  visit("volume_ratio_se", e.volume_ratio_se);
}

template <class Visit, IsRecord<ReconstructedMode> Record>
void each_member(Visit&& visit, Record& m) {
  visit("words", m.words);
  visit("se_mm", m.se_mm);
}

template <class Visit, IsRecord<CrossValidationCurve> Record>
void each_member(Visit&& visit, Record& c) {
  visit("frame", c.frame);
  visit("lambda", c.lambda);
  visit("score", c.score);
  visit("degrees_of_freedom", c.degrees_of_freedom);
}

template <class Visit, IsRecord<ReconstructionRecord> Record>
void each_member(Visit&& visit, Record& r) {
  visit("study", r.study);
  visit("data", r.data);
  visit("mesh", r.mesh);
  visit("unknowns", r.unknowns);
  visit("smoothing", r.smoothing);
  visit("points_a_frame", r.points_a_frame);
  visit("seconds", r.seconds);
  visit("findings", r.findings);
  visit("frames", r.frames);
  visit("families", r.families);
  visit("slices", r.slices);
  visit("elements", r.elements);
  visit("modes_seen", r.modes_seen);
  visit("simple_motions", r.simple_motions);
  visit("curves", r.curves);
  visit("residual_edges", r.residual_edges);
  visit("residual_counts", r.residual_counts);
}

template <>
struct JsonForm<Finding> {
  static Json written(const Finding& finding) { return from_finding(finding); }
  static void read(const Json& json, Finding& finding) { finding = to_finding(json); }
};

namespace {

constexpr int newest_version = 1;

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
  Json json = {{"format", reconstruction_file_mark}, {"format_version", newest_version}};
  json.update(written(record));
  json["sections"] = Json::array();
  for (const SolutionSection& section : record.sections) {
    if (with_sections) json["sections"].push_back(from_section(section));
  }
  return json.dump(with_sections ? -1 : 1) + "\n";
}

bool is_reconstruction(std::string_view text) {
  constexpr size_t head = 200;
  return text.substr(0, head).find(reconstruction_file_mark) != std::string_view::npos;
}

ReconstructionRecord reconstruction_record_from_json(std::string_view text, const std::string& file) {
  const std::string remedy = "Give a file that `diastole reconstruct STUDY -o NAME.json` wrote.";
  try {
    const Json json = Json::parse(text);
    if (!json.is_object() || json.value("format", "") != reconstruction_file_mark)
      throw InputError({file, "key format", fmt::format("is not \"{}\"", reconstruction_file_mark), remedy});
    int version = 0;
    read_json(json.at("format_version"), version);
    if (version > newest_version) {
      throw InputError(
          {file, "key format_version",
           fmt::format("version {} is newer than this program knows ({})", version, newest_version),
           "Update the program."});
    }
    ReconstructionRecord record;
    read_json(json, record);
    for (const Json& section : json.at("sections"))
      record.sections.push_back(to_section(section));
    require_lengths(record);
    return record;
  } catch (const nlohmann::json::exception& error) {
    throw InputError({file, "", fmt::format("is not a reconstruction: {}", error.what()), remedy});
  } catch (const std::invalid_argument& error) {
    throw InputError({file, "", fmt::format("is not a reconstruction: {}", error.what()), remedy});
  }
}

}  // namespace diastole
