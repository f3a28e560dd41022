#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/imaging/geometry/cine_points.hpp"
#include "estimator/imaging/geometry/ventricle_files.hpp"
#include "estimator/imaging/geometry/ventricle_record.hpp"
#include "estimator/imaging/geometry/ventricle_session.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/report.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

struct VentricleArguments {
  imaging::VentricleRequest request;
  fs::path output;
  std::vector<size_t> elements;
  std::vector<double> fibre_deg;
  bool keep_slices = false;
  std::optional<fs::path> surface, volumes, page, guide;
  bool force = false;
};

Json interval_of(double value, double sigma) {
  return {{"value", value},
          {"se", sigma},
          {"ci95", {value - inference::normal_95 * sigma, value + inference::normal_95 * sigma}}};
}

Json coordinates(const Eigen::Vector3d& x) { return {x.x(), x.y(), x.z()}; }

Json ventricle_phases(const imaging::VentricleSession& session) {
  Json phases = Json::array();
  for (size_t p = 0; p < session.phases.size(); ++p) {
    const imaging::VentriclePhase& phase = session.phases[p];
    phases.push_back({{"phase", phase.phase},
                      {"cavity_mL", phase.mesh.cavity_mL},
                      {"cavity_sigma_mL", phase.cavity_sigma_mL},
                      {"wall_mL", phase.mesh.wall_mL},
                      {"thickness_mm",
                       {{"mean", phase.mean_thickness_mm},
                        {"least", phase.least_thickness_mm},
                        {"most", phase.most_thickness_mm}}},
                      {"points", session.fit.phases[p].points},
                      {"rms_mm", session.fit.phases[p].rms_mm},
                      {"least_jacobian", phase.mesh.least_jacobian},
                      {"mesh_error_mm", phase.mesh_error_mm}});
  }
  return phases;
}

Json to_json(const imaging::VentricleSession& session, const fs::path& mesh, double seconds) {
  const imaging::VentricleFit& fit = session.fit;
  const imaging::VentriclePhase& chosen = session.phases[session.chosen];
  Json shifts = Json::array();
  for (const imaging::SliceShift& shift : fit.shifts)
    shifts.push_back({{"slice", shift.slice},
                      {"shift_mm", coordinates(shift.shift_mm)},
                      {"sigma_mm", shift.sigma_mm},
                      {"reference", shift.is_reference}});
  const Eigen::Matrix3d& axes = fit.frame.axes;
  Json json = {{"mesh", mesh.string()},
               {"phase", chosen.phase},
               {"rms_mm", fit.rms_mm},
               {"cavity_mL", chosen.mesh.cavity_mL},
               {"cavity_sigma_mL", chosen.cavity_sigma_mL},
               {"wall_mL", chosen.mesh.wall_mL},
               {"slice_shifts_mm", std::move(shifts)},
               {"shift_spread_mm", fit.shift_spread_mm},
               {"noise_factor", fit.noise_factor},
               {"elements", session.body.mesh.element_count()},
               {"nodes", session.body.mesh.node_count()},
               {"node_sigma_mm", session.node_sigma_mm},
               {"least_jacobian", chosen.mesh.least_jacobian},
               {"mesh_error_mm", chosen.mesh_error_mm},
               {"heart_axes",
                {{"origin_mm", coordinates(fit.frame.origin_mm)},
                 {"x", coordinates(axes.col(0))},
                 {"y", coordinates(axes.col(1))},
                 {"z_apex_to_base", coordinates(axes.col(2))}}},
               {"phases", ventricle_phases(session)}};
  if (session.phases.size() > 1) {
    const imaging::VentriclePhase& most = session.phases[session.largest()];
    const imaging::VentriclePhase& least = session.phases[session.smallest()];
    json["stroke_mL"] = interval_of(most.mesh.cavity_mL - least.mesh.cavity_mL,
                                    std::hypot(most.cavity_sigma_mL, least.cavity_sigma_mL));
    json["ejection_fraction"] = interval_of(session.ejection_fraction(), session.ejection_sigma());
    json["largest_phase"] = most.phase;
    json["smallest_phase"] = least.phase;
  }
  json["iterations"] = fit.iterations;
  json["converged"] = fit.converged;
  json["problems"] = written(fit.findings);
  json["seconds"] = seconds;
  return json;
}

void print_shifts(const imaging::VentricleFit& fit) {
  double largest = 0;
  for (const imaging::SliceShift& shift : fit.shifts)
    largest = std::max(largest, shift.shift_mm.norm() / std::max(shift.sigma_mm, 1e-9));
  if (std::all_of(fit.shifts.begin(), fit.shifts.end(),
                  [](const auto& shift) { return shift.is_reference; })) {
    fmt::print("Slices are taken to be where they belong.\n");
    return;
  }
  // Of a score of slices the largest of pure error is below four sigmas.
  if (fit.shift_spread_mm == 0 || largest < 4) {
    fmt::print("Slices are where they belong, within {:.2f} mm.\n", fit.shift_spread_mm);
    return;
  }
  fmt::print("Slices that were displaced, and are put back:\n");
  for (const imaging::SliceShift& shift : fit.shifts)
    if (!shift.is_reference)
      fmt::print("  {:8} by {:5.2f} mm  ({:6.2f}, {:6.2f}, {:6.2f}), each within {:.2f} mm\n", shift.slice,
                 shift.shift_mm.norm(), shift.shift_mm.x(), shift.shift_mm.y(), shift.shift_mm.z(),
                 shift.sigma_mm);
}

void print_ventricle(const imaging::VentricleSession& session, double seconds) {
  const imaging::VentricleFit& fit = session.fit;
  const imaging::VentriclePhase& chosen = session.phases[session.chosen];
  fmt::print("Walls: points lie {:.2f} mm RMS from them, {:.2f} times the errors that they state\n",
             fit.rms_mm, fit.noise_factor);
  print_shifts(fit);
  fmt::print(
      "Phase {}: cavity {:.2f} mL (standard error {:.2f}), wall {:.2f} mL, {:.1f} mm thick ({:.1f} to "
      "{:.1f})\n",
      chosen.phase, chosen.mesh.cavity_mL, chosen.cavity_sigma_mL, chosen.mesh.wall_mL,
      chosen.mean_thickness_mm, chosen.least_thickness_mm, chosen.most_thickness_mm);
  if (session.phases.size() > 1) {
    const imaging::VentriclePhase& most = session.phases[session.largest()];
    const imaging::VentriclePhase& least = session.phases[session.smallest()];
    fmt::print(
        "Cavity from {:.2f} mL (phase {}) to {:.2f} mL (phase {}): ejection {:.1f} % (standard error "
        "{:.1f})\n",
        most.mesh.cavity_mL, most.phase, least.mesh.cavity_mL, least.phase, 100 * session.ejection_fraction(),
        100 * session.ejection_sigma());
  }
  if (!fit.converged) fmt::print("The fit did not settle in {} iterations.\n", fit.iterations);
  print_findings(fit.findings, stdout);
  fmt::print("{:.1f} s\n", seconds);
}

/// Refuses what is wrong on the command line, and with output files, before anything is read.
imaging::VentricleRequest checked_request(const VentricleArguments& arguments) {
  imaging::VentricleRequest request = arguments.request;
  if (!arguments.elements.empty()) {
    const std::vector<size_t>& n = arguments.elements;
    if (n[0] < 3 || n[1] < 2 || n[2] < 1)
      throw InputError(
          {"", "--mesh", fmt::format("{},{},{} makes no ventricle", n[0], n[1], n[2]),
           "Give at least 3 elements around, 2 from apex to base and 1 through the wall: --mesh 8,5,2."});
    request.mesh.elements = {n[0], n[1], n[2]};
  }
  if (!arguments.fibre_deg.empty()) request.fibre_deg = {arguments.fibre_deg[0], arguments.fibre_deg[1]};
  request.fit.estimate_shifts = !arguments.keep_slices;
  if (const std::string ending = arguments.output.extension().string();
      ending != ".mesh" && ending != ".toml")
    throw InputError({arguments.output.string(), "--output", "is no name of a mesh",
                      "Give heart.mesh, say; the tables are --volumes, --surface and --guide."});
  RequiredOutputs outputs({request.guide}, arguments.force);
  outputs.add(arguments.output, mesh_file_mark);
  outputs.add(arguments.surface, imaging::surface_file_mark);
  outputs.add(arguments.volumes, imaging::volume_file_mark);
  outputs.add(arguments.guide, "");  // a person may have set its points
  outputs.add(arguments.page, report::page_mark);
  return request;
}

/// Of a file, or found in a folder's cines.
imaging::GuidePoints given_points(const fs::path& guide,
                                  const std::function<void(const std::string&)>& report_stage) {
  if (!fs::is_directory(guide)) return imaging::read_guide_points(guide);
  report_stage(fmt::format("reading {}", guide.string()));
  const imaging::Cines cines = imaging::read_cines(imaging::read_image_folder(guide));
  report_stage("finding walls in the images");
  return imaging::cine_guide_points(cines);
}

ExitCode run_ventricle(const VentricleArguments& arguments, const CommandOutput& out) {
  const auto start = std::chrono::steady_clock::now();
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  const imaging::VentricleRequest request = checked_request(arguments);
  const auto report_stage = [&](const std::string& stage) {
    if (shows_progress) fmt::print(stderr, "{}\n", stage);
  };
  const imaging::GuidePoints guide = given_points(request.guide, report_stage);
  const imaging::VentricleSession session = imaging::measure_ventricle(request, guide, report_stage);
  write_whole_file(arguments.output, mesh_file_text(session.body));
  if (arguments.guide) write_whole_file(*arguments.guide, imaging::guide_file_text(guide));
  if (arguments.surface) write_whole_file(*arguments.surface, imaging::surface_file_text(session));
  if (arguments.volumes) write_whole_file(*arguments.volumes, imaging::volume_file_text(session));
  if (arguments.page)
    write_whole_file(*arguments.page, report::make_report(imaging::ventricle_record(session, guide)));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (out.json) {
    std::cout << json_text(to_json(session, arguments.output, seconds), 1) << '\n';
    return ExitCode::done;
  }
  print_ventricle(session, seconds);
  fmt::print("The mesh is in {}\n", arguments.output.string());
  if (arguments.guide) fmt::print("The points, to look at and to edit: {}\n", arguments.guide->string());
  if (arguments.surface) fmt::print("Points of its surfaces: {}\n", arguments.surface->string());
  if (arguments.volumes) fmt::print("Volumes: {}\n", arguments.volumes->string());
  if (arguments.page) fmt::print("The page to look at: {}\n", arguments.page->string());
  return ExitCode::done;
}

}  // namespace

void add_ventricle(CommandLine& line) {
  auto arguments = std::make_shared<VentricleArguments>();
  CLI::App* command = line.add(
      "lv", "a ventricle's mesh, volumes and wall thickness from guide points or contours in its images",
      "  diastole lv heart.guide.csv -o heart.mesh\n"
      "  diastole lv heart.guide.csv -o heart.mesh --volumes heart.volumes.csv --page heart.html\n"
      "  diastole lv heart.guide.csv -o systole.mesh --phase 6 --mesh 12,6,2\n"
      "  diastole lv GPFile.txt -o heart.mesh --fibre-deg 60,-60 --json\n"
      "  diastole lv dicom/ -o heart.mesh --guide heart.guide.csv\n"
      "      the same from points that are found in cine images; edit them, and give them instead of the "
      "folder\n"
      "A study uses the mesh with kind = \"fitted-lv\" and mesh_file = \"heart.mesh\".\n"
      "docs/lv.md says what the points are, and how slices of different breath holds are put together.");
  VentricleArguments& a = *arguments;
  command
      ->add_option("GUIDE", a.request.guide,
                   "guide points (*.guide.csv, or biv-me's GPFile), or a folder of cine images")
      ->required();
  command->add_option("-o,--output", a.output, "the mesh of one phase (*.mesh)")->required();
  command
      ->add_option("--phase", a.request.phase, "the mesh's phase, as the file numbers it; default: the first")
      ->check(nonnegative_number);
  command->add_option("--mesh", a.elements, "elements around, from apex to base, through the wall (8,5,2)")
      ->delimiter(',')
      ->expected(3);
  command
      ->add_option("--fibre-deg", a.fibre_deg,
                   "fibre angle at the endocardium and at the epicardium, for laws with fibres")
      ->check(number_between(-90.0, 90.0))
      ->delimiter(',')
      ->expected(2);
  command->add_option("--guide", a.guide,
                      "the guide points as they are used, those found in a folder too (*.guide.csv)");
  command->add_option("--surface", a.surface, "points of the surfaces in all phases (*.csv)");
  command->add_option("--volumes", a.volumes, "volumes and wall thickness in all phases (*.csv)");
  command->add_option("--page", a.page,
                      "a page to look at: sections with the points, volumes, thickness, slices");
  auto* reference = command
                        ->add_option("--reference", a.request.fit.reference_slices,
                                     "slices that are where they belong; default: the long-axis ones")
                        ->delimiter(',');
  command->add_flag("--keep-slices", a.keep_slices, "no slice was displaced by its breath hold")
      ->excludes(reference);
  command->add_flag("--force", a.force, "replace output files that are none of lv's");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_ventricle(*arguments, out); });
}

}  // namespace diastole
