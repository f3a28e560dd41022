#include "estimator/cli/solution_outputs.hpp"

#include <array>

#include "estimator/io/whole_file.hpp"
#include "estimator/solution/gauss_table.hpp"
#include "estimator/solution/solution_record.hpp"

namespace diastole {
namespace {

constexpr std::array kinds{vtkhdf_kind, OutputKind{".csv", "frame,time_s,pressure_kPa,element,point"},
                           OutputKind{".json", solution_file_mark}};

SolutionRecord record_of(const Study& study, const ElasticModel& model, const ElasticState& state) {
  SolutionRecord record = solution_record(model, state);
  record.study = study.file.string();
  for (const StudyParameter& parameter : study.law.parameters)
    record.parameters.emplace_back(parameter.name, parameter.start);
  record.mesh = mesh_of(study.specimen);
  return record;
}

}  // namespace

void require_outputs(const OutputFiles& outputs, const Study& study) {
  outputs.require(
      inputs_of(study), kinds, "is no kind of file that a solution is written to",
      "End it in .vtkhdf (for ParaView), .csv (stress and strain at the Gauss points) or .json (for "
      "`diastole report`).");
}

void write_outputs(const OutputFiles& outputs, const Study& study, const ElasticModel& model,
                   std::span<const SolvedFrame> frames) {
  for (const std::filesystem::path& file : outputs.files) {
    if (file.extension() == ".vtkhdf") write_vtkhdf(file, solution_grid(model, frames));
    if (file.extension() == ".csv") write_whole_file(file, gauss_table(model, frames));
    if (file.extension() == ".json")
      write_whole_file(file, to_json(record_of(study, model, frames.back().state)));
  }
}

}  // namespace diastole
