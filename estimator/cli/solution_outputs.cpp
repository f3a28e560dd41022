#include "estimator/cli/solution_outputs.hpp"

#include <string_view>

#include "estimator/io/whole_file.hpp"
#include "estimator/solution/gauss_table.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr std::string_view hdf5_mark = "HDF\r\n";
constexpr std::string_view table_mark = "frame,time_s,pressure_kPa,element,point";

std::string_view mark_of(const std::filesystem::path& file) {
  if (file.extension() == ".vtkhdf") return hdf5_mark;
  if (file.extension() == ".csv") return table_mark;
  throw InputError({file.string(), "", "is no kind of file that a solution is written to",
                    "End it in .vtkhdf (for ParaView) or .csv (stress and strain at the Gauss points)."});
}

}  // namespace

void add_output_options(CLI::App& command, SolutionOutputs& outputs) {
  command
      .add_option("-o,--output", outputs.files,
                  "a .vtkhdf file for ParaView, or a .csv of stress and strain; may be repeated")
      ->allow_extra_args(false);
  command.add_flag("--force", outputs.force, "replace an output file that is no earlier result");
}

void require_outputs(const SolutionOutputs& outputs, const Study& study) {
  for (const std::filesystem::path& file : outputs.files)
    require_output({file, inputs_of(study), mark_of(file), outputs.force});
}

void write_outputs(const SolutionOutputs& outputs, const ElasticModel& model,
                   std::span<const SolvedFrame> frames) {
  for (const std::filesystem::path& file : outputs.files) {
    if (file.extension() == ".vtkhdf") write_vtkhdf(file, solution_grid(model, frames));
    if (file.extension() == ".csv") write_whole_file(file, gauss_table(model, frames));
  }
}

}  // namespace diastole
