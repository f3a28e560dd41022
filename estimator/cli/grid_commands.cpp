#include "estimator/cli/grid_commands.hpp"

#include <fmt/format.h>

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "estimator/grids/displaced_points.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

struct GridArguments {
  std::filesystem::path grid, output;
  std::optional<std::filesystem::path> frames;
  std::string unit = "mm", field, array = "physical";
  std::string endo, epi, base;
  double sigma_mm = 0.0;
  bool force = false;
};

ExitCode run_points(const GridArguments& arguments, const CommandOutput& out) {
  RequiredOutputs outputs({arguments.grid}, arguments.force);
  outputs.add(arguments.output, "frame,X_mm");
  outputs.add(arguments.frames, "frame,time_s");
  const FieldGrid grid = read_grid(arguments.grid.string());
  const DisplacedPoints points = displaced_points(
      grid, {arguments.field, mm_per_unit(arguments.unit), arguments.sigma_mm}, arguments.grid.string());
  write_whole_file(arguments.output, points.points_csv);
  std::vector<std::string> remarks{
      fmt::format("{} points in {} frame{}.", points.points, points.frames, points.frames == 1 ? "" : "s")};
  if (arguments.frames && points.frames_csv.empty()) {
    remarks.push_back("The grid has no pressure_kPa for every step: write the frames file by hand.");
  } else if (arguments.frames) {
    write_whole_file(*arguments.frames, points.frames_csv);
    remarks.push_back(fmt::format("Pressures, without error, in {}.", arguments.frames->string()));
  }
  return report_written({arguments.output, grid.cells.size(), points.points, false, std::move(remarks)},
                        "Written:", out);
}

ExitCode run_surface(const GridArguments& arguments, const CommandOutput& out) {
  require_output({arguments.output, {arguments.grid}, "phase,slice,surface", arguments.force});
  const FieldGrid grid = read_grid(arguments.grid.string());
  std::vector<SurfaceChoice> choices{{"endo", arguments.endo}, {"epi", arguments.epi}};
  if (!arguments.base.empty()) choices.push_back({"base", arguments.base});
  const SurfacePoints found = surface_points(grid, arguments.array, choices, mm_per_unit(arguments.unit),
                                             arguments.sigma_mm, arguments.grid.string());
  write_whole_file(arguments.output, found.guide_csv);
  std::vector<std::string> remarks;
  size_t points = 0;
  for (size_t i = 0; i < choices.size(); ++i) {
    remarks.push_back(fmt::format("{}: {} points.", choices[i].surface, found.points[i]));
    points += found.points[i];
  }
  return report_written({arguments.output, grid.cells.size(), points, false, std::move(remarks)},
                        "Written:", out);
}

void add_common(CLI::App& command, GridArguments& arguments, const char* output) {
  command.add_option("GRID", arguments.grid, "a .vtu, .xdmf or .msh file")->required();
  command.add_option("-o,--output", arguments.output, output)->required();
  command.add_option("--sigma-mm", arguments.sigma_mm, "standard deviation of each coordinate")
      ->required()
      ->check(positive_number);
  command.add_option("--unit", arguments.unit, "length in the grid")
      ->check(CLI::IsMember({"mm", "cm", "m"}))
      ->capture_default_str();
  command.add_flag("--force", arguments.force, "replace an output file that is none of these");
  command.fallthrough();
}

}  // namespace

double mm_per_unit(const std::string& unit) { return unit == "m" ? 1000.0 : unit == "cm" ? 10.0 : 1.0; }

ExitCode report_written(const WrittenMesh& written, std::string_view sentence, const CommandOutput& out) {
  if (out.json) {
    const nlohmann::ordered_json json = {{"mesh", written.file.string()},
                                         {"elements", written.elements},
                                         {"nodes", written.nodes},
                                         {"fibres", written.has_fibres},
                                         {"remarks", written.remarks}};
    std::cout << json_text(json, 1) << '\n';
    return ExitCode::done;
  }
  for (const std::string& remark : written.remarks)
    fmt::print("{}\n", remark);
  fmt::print("{} {}\n", sentence, written.file.string());
  return ExitCode::done;
}

void add_grid_commands(CLI::App& mesh, CommandLine& line) {
  auto points = std::make_shared<GridArguments>();
  CLI::App* displaced =
      mesh.add_subcommand("points", "a grid's displacements as a study's points (NAME.points.csv)");
  add_common(*displaced, *points, "the points to write (*.points.csv)");
  displaced->add_option("--field", points->field, "the array of displacements, if it is not called like one");
  displaced->add_option(
      "--frames", points->frames,
      "the loads to write (*.frames.csv), where the grid has a pressure_kPa for every step");
  line.on_run(displaced, [points](const CommandOutput& out) { return run_points(*points, out); });

  auto surface = std::make_shared<GridArguments>();
  CLI::App* walls =
      mesh.add_subcommand("surface", "a grid's walls as guide points of `diastole lv` (NAME.guide.csv)");
  add_common(*walls, *surface, "the guide points to write (*.guide.csv)");
  walls
      ->add_option("--array", surface->array,
                   "the cell array whose values tell surfaces apart; of Gmsh the physical groups")
      ->capture_default_str();
  walls->add_option("--endo", surface->endo, "value or name of the inner wall")->required();
  walls->add_option("--epi", surface->epi, "value or name of the outer wall")->required();
  walls->add_option("--base", surface->base, "value or name of the base, where the grid has it");
  line.on_run(walls, [surface](const CommandOutput& out) { return run_surface(*surface, out); });
}

}  // namespace diastole
