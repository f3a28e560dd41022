#include "estimator/cli/solution_outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>

#include "estimator/grids/vtu_file.hpp"
#include "estimator/grids/xdmf_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/solution/hexahedral_grid.hpp"
#include "estimator/solution/solution_record.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"

namespace diastole {
namespace {

constexpr std::array kinds{vtkhdf_kind,
                           OutputKind{".csv", "frame,time_s,pressure_kPa,element,point"},
                           OutputKind{".json", solution_file_mark},
                           OutputKind{".vtu", "<VTKFile"},
                           OutputKind{".xdmf", "<Xdmf"},
                           OutputKind{".feb", "<febio_spec"}};

SolutionRecord record_of(const Study& study, const ElasticModel& model, const ElasticState& state) {
  SolutionRecord record = solution_record(model, state);
  record.study = study.file.string();
  for (const StudyParameter& parameter : study.law.parameters)
    record.parameters.emplace_back(parameter.name, parameter.start);
  record.mesh = mesh_of(study.specimen);
  return record;
}

Sampling sampling_of(const std::string& text) {
  constexpr size_t most = 32;
  const auto sampling = parse_numbers<size_t, 3>(text);
  if (!sampling || std::ranges::min(*sampling) < 1 || std::ranges::max(*sampling) > most)
    throw InputError({"", "--cells " + text, fmt::format("is not three whole numbers from 1 to {}", most),
                      "Write cells an element around, along and through the wall, as --cells 4,4,4."});
  return *sampling;
}

std::string febio_text(const std::string& file, const ElasticModel& model,
                       std::span<const SolvedFrame> frames, const Sampling& sampling) {
  const HexahedralMesh mesh = hexahedral_mesh(model.mesh(), sampling);
  try {
    return feb_text(febio_model(model, frames, mesh));
  } catch (const std::invalid_argument& error) {
    throw InputError({file, "", fmt::format("cannot hold this study: {}", error.what()),
                      "Write the solution to .vtu or .xdmf instead, or choose another law."});
  }
}

}  // namespace

void SolutionOutputs::add_options(CLI::App& command) {
  files.add_options(
      command,
      "a .vtkhdf file for ParaView, .vtu or .xdmf of plain hexahedra, a .feb for FEBio, a .csv of stress and "
      "strain, or a .json for the report");
  command
      .add_option("--cells", cells, "of .vtu, .xdmf and .feb: hexahedra an element around, along, through")
      ->capture_default_str();
}

void SolutionOutputs::require(const Study& study, bool several_frames) const {
  files.require(inputs_of(study), kinds, "is no kind of file that a solution is written to",
                "End it in .vtkhdf (for ParaView), .vtu, .xdmf, .feb (for other programs), .csv (stress and "
                "strain at the "
                "Gauss points) or .json (for `diastole report`).");
  (void)sampling_of(cells);
  for (const std::filesystem::path& file : files.files) {
    if (file.extension() == ".xdmf")
      require_output({numbers_beside(file), inputs_of(study), vtkhdf_kind.mark, files.force});
    if (file.extension() == ".vtu" && several_frames)
      throw InputError({file.string(), "--frames", "are several states, and a .vtu holds one",
                        "End the file in .xdmf or .vtkhdf, or solve for one --pressure-kPa."});
  }
}

void SolutionOutputs::write(const Study& study, const ElasticModel& model,
                            std::span<const SolvedFrame> frames) const {
  const Sampling sampling = sampling_of(cells);
  for (const std::filesystem::path& file : files.files) {
    const std::string ending = file.extension().string();
    if (ending == ".vtkhdf") write_vtkhdf(file, solution_grid(model, frames));
    if (ending == ".csv") write_whole_file(file, gauss_table(model, frames));
    if (ending == ".json") write_whole_file(file, to_json(record_of(study, model, frames.back().state)));
    if (ending == ".xdmf") write_xdmf(file, hexahedral_grid(model, frames, sampling));
    if (ending == ".feb") write_whole_file(file, febio_text(file.string(), model, frames, sampling));
    if (ending == ".vtu") {
      const FieldGrid grid = hexahedral_grid(model, frames, sampling);
      write_whole_file(file, vtu_text(grid, grid.steps.front()));
    }
  }
}

}  // namespace diastole
