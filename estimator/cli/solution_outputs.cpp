#include "estimator/cli/solution_outputs.hpp"

#include <string_view>

#include "estimator/io/whole_file.hpp"
#include "estimator/solution/gauss_table.hpp"
#include "estimator/solution/solution_record.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::string_view hdf5_mark = "HDF\r\n";
constexpr std::string_view table_mark = "frame,time_s,pressure_kPa,element,point";

std::string_view mark_of(const std::filesystem::path& file) {
  if (file.extension() == ".vtkhdf") return hdf5_mark;
  if (file.extension() == ".csv") return table_mark;
  if (file.extension() == ".json") return solution_file_mark;
  throw InputError(
      {file.string(), "", "is no kind of file that a solution is written to",
       "End it in .vtkhdf (for ParaView), .csv (stress and strain at the Gauss points) or .json (for "
       "`diastole report`)."});
}

SolutionRecord record_of(const Study& study, const ElasticModel& model, const ElasticState& state) {
  SolutionRecord record = solution_record(model, state);
  record.study = study.file.string();
  for (const StudyParameter& parameter : study.law.parameters)
    record.parameters.emplace_back(parameter.name, parameter.start);
  record.mesh = mesh_of(study.specimen);
  return record;
}

}  // namespace

void add_output_options(CLI::App& command, SolutionOutputs& outputs) {
  command
      .add_option("-o,--output", outputs.files,
                  "a .vtkhdf file for ParaView, a .csv of stress and strain, or a .json for the report; may "
                  "be repeated")
      ->allow_extra_args(false);
  command.add_flag("--force", outputs.force, "replace an output file that is no earlier result");
}

void require_outputs(const SolutionOutputs& outputs, const Study& study) {
  for (const std::filesystem::path& file : outputs.files)
    require_output({file, inputs_of(study), mark_of(file), outputs.force});
}

void write_outputs(const SolutionOutputs& outputs, const Study& study, const ElasticModel& model,
                   std::span<const SolvedFrame> frames) {
  for (const std::filesystem::path& file : outputs.files) {
    if (file.extension() == ".vtkhdf") write_vtkhdf(file, solution_grid(model, frames));
    if (file.extension() == ".csv") write_whole_file(file, gauss_table(model, frames));
    if (file.extension() == ".json")
      write_whole_file(file, to_json(record_of(study, model, frames.back().state)));
  }
}

}  // namespace diastole
