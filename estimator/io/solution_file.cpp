#include "estimator/io/solution_file.hpp"

#include "estimator/io/record_file.hpp"
#include "estimator/io/section_json.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

template <class Visit, IsRecord<SolutionProfile> Record>
void each_member(Visit&& visit, Record& profile) {
  DIASTOLE_VISIT(visit, profile, title, depth_mm)
  visit("fields", by_name(profile.fields));
}

template <class Visit, IsRecord<SolutionRecord> Record>
void each_member(Visit&& visit, Record& record) {
  DIASTOLE_VISIT(visit, record, study, law)
  visit("parameters", by_name(record.parameters));
  DIASTOLE_VISIT(visit, record, mesh, unknowns, pressure_kPa, cavity_volume_mL, cavity_volume_change_mL,
                 fibres, sections, profiles)
}

namespace {

constexpr RecordFormat solution_format{solution_file_mark, "a solution",
                                       "Give a file that `diastole solve STUDY -o NAME.json` wrote."};

}  // namespace

std::string to_json(const SolutionRecord& record) {
  Json json = solution_format.document(written(record));
  round_numbers(json["sections"], six_digits);
  round_numbers(json["profiles"], six_digits);
  return json_text(json) + "\n";
}

bool is_solution(std::string_view text) { return solution_format.marks(text); }

SolutionRecord solution_record_from_json(std::string_view text, const std::string& file) {
  SolutionRecord record;
  solution_format.read(text, file, [&](const Json& json) {
    read_json(json, record);
    require_sound(record.sections);
    for (const SolutionProfile& profile : record.profiles)
      require_lengths(profile.fields, profile.depth_mm.size());
  });
  return record;
}

}  // namespace diastole
