#include <fmt/format.h>

#include <memory>
#include <string>
#include <vector>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/grid_commands.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/mesh/exfile_import.hpp"
#include "estimator/mesh/mesh_file.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/model/unloaded_model.hpp"

namespace diastole {
namespace {

struct MeshArguments {
  std::vector<std::filesystem::path> inputs;  // of import: exnode, exelem; of export: the study
  std::filesystem::path output;
  std::string unit = "mm";
  bool force = false;
  bool unload = false;
};

ExitCode write_mesh(const MeshArguments& arguments, const MeshBody& body,
                    const std::vector<std::string>& remarks, const CommandOutput& out) {
  write_whole_file(arguments.output, mesh_file_text(body));
  return report_written(
      {arguments.output, body.mesh.element_count(), body.mesh.node_count(), body.fibres.has_value(), remarks},
      "The mesh is in", out);
}

ExitCode run_import(const MeshArguments& arguments, const CommandOutput& out) {
  require_output({arguments.output, arguments.inputs, mesh_file_mark, arguments.force});
  const std::string exnode = read_whole_file(arguments.inputs[0]);
  const std::string exelem = read_whole_file(arguments.inputs[1]);
  const ImportedMesh imported =
      import_exfiles({exnode, arguments.inputs[0].string()}, {exelem, arguments.inputs[1].string()},
                     mm_per_unit(arguments.unit));
  return write_mesh(arguments, imported.body, imported.remarks, out);
}

/// Of a shape that was imaged under load, the one without.
ExitCode export_unloaded(const MeshArguments& arguments, const Study& study, const CommandOutput& out) {
  const UnloadedModel unloaded = unload(study);
  if (!unloaded.returned()) {
    fmt::print(stderr, "diastole mesh: {}\n", unloaded.describe());
    return ExitCode::negative;
  }
  const UnloadedBody found = unloaded_body(unloaded);
  std::vector<std::string> remarks{fmt::format(
      "{} elements, {} nodes; {:g} kPa bring the image back to {:.2g} mm.", found.body.mesh.element_count(),
      found.body.mesh.node_count(), study.imaged_at->pressure_kPa, unloaded.back.farthest_mm)};
  if (found.body.fibres)
    remarks.push_back(
        fmt::format("Fibres carried with the material; as angles at the nodes they are {:.2g} degrees off "
                    "(root mean square).",
                    found.fibre_rms_deg));
  return write_mesh(arguments, found.body, remarks, out);
}

ExitCode run_export(const MeshArguments& arguments, const CommandOutput& out) {
  const Study study = read_study(arguments.inputs[0]);
  require_output({arguments.output, inputs_of(study), mesh_file_mark, arguments.force});
  if (arguments.unload) return export_unloaded(arguments, study, out);
  const MeshBody body = study_body(study);
  return write_mesh(
      arguments, body,
      {fmt::format("{} elements, {} nodes.", body.mesh.element_count(), body.mesh.node_count())}, out);
}

void add_output(CLI::App& command, MeshArguments& arguments) {
  command.add_option("-o,--output", arguments.output, "the mesh file to write (*.mesh.toml)")->required();
  command.add_flag("--force", arguments.force, "replace an output file that is no mesh");
  command.fallthrough();
}

}  // namespace

void add_mesh(CommandLine& line) {
  CLI::App* command = line.add(
      "mesh", "mesh files: from exnode and exelem files, of a study's specimen; points from other grids",
      "  diastole mesh import heart.exnode heart.exelem -o heart.mesh.toml\n"
      "  diastole mesh export phantom-a.study.toml -o gel.mesh.toml\n"
      "  diastole mesh export examples/imaged-ventricle.study.toml --unload -o unloaded.mesh.toml\n"
      "  diastole mesh points theirs.xdmf --sigma-mm 0.3 -o theirs.points.csv --frames theirs.frames.csv\n"
      "  diastole mesh surface theirs.msh --endo inside --epi outside --base base --sigma-mm 0.5 -o "
      "theirs.guide.csv\n"
      "A study uses one with kind = \"mesh\" and file = \"heart.mesh.toml\".");
  command->require_subcommand(1);

  auto import = std::make_shared<MeshArguments>();
  CLI::App* from_ex =
      command->add_subcommand("import", "a mesh of exnode and exelem files (CMISS, cmgui, OpenCMISS)");
  from_ex->add_option("EXNODE EXELEM", import->inputs, "the nodes and the elements")->required()->expected(2);
  from_ex->add_option("--unit", import->unit, "length of their coordinates")
      ->check(CLI::IsMember({"mm", "cm", "m"}))
      ->capture_default_str();
  add_output(*from_ex, *import);
  line.on_run(from_ex, [import](const CommandOutput& out) { return run_import(*import, out); });

  auto written = std::make_shared<MeshArguments>();
  CLI::App* from_study =
      command->add_subcommand("export", "the mesh of a study's specimen, refined as the study says");
  from_study->add_option("STUDY", written->inputs, "study file (*.study.toml)")->required()->expected(1);
  from_study->add_flag(
      "--unload", written->unload,
      "the shape without the load under which the study's was imaged (imaged_at_kPa), at the start values");
  add_output(*from_study, *written);
  line.on_run(from_study, [written](const CommandOutput& out) { return run_export(*written, out); });
  add_grid_commands(*command, line);
}

}  // namespace diastole
