#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/page_and_record.hpp"
#include "estimator/imaging/diffusion/fibre_grid.hpp"
#include "estimator/imaging/diffusion/fibre_session.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/report/page.hpp"
#include "estimator/report/report.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

struct FibresArguments {
  imaging::FibreSessionRequest session;
  std::optional<fs::path> study, mesh;
  std::optional<fs::path> output, tensors, page, record, grid;
  std::string axes;
  bool force = false;
};

Json patient_axes(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json outliers_json(const imaging::FibreSession& session) {
  Json list = Json::array();
  for (const imaging::SignalOutlier& outlier : session.outliers) {
    const imaging::DiffusionVolume& volume = session.series.volumes[outlier.volume];
    list.push_back({{"slice", outlier.slice + 1},
                    {"volume", outlier.volume + 1},
                    {"b_s_mm2", volume.b_s_mm2()},
                    {"direction", patient_axes(volume.direction())},
                    {"gain", outlier.gain}});
  }
  return list;
}

Json axes_json(const imaging::FibreSession& session) {
  if (!session.axes) return nullptr;
  const imaging::AxisCheck& check = *session.axes;
  const Eigen::Matrix3d& change = check.chosen.change;
  return {{"ok", !check.is_wrong && !check.is_doubtful},
          {"informative", check.informative},
          {"correction", check.chosen.name},
          {"change", {patient_axes(change.row(0)), patient_axes(change.row(1)), patient_axes(change.row(2))}},
          {"agreement", check.chosen.agreement},
          {"agreement_as_said", check.as_said.agreement},
          {"helix_slope_deg", check.chosen.helix_slope_deg},
          {"candidates", check.candidates.size()}};
}

Json to_json(const imaging::FibreSession& session, double seconds) {
  Json json = {{"b_values", session.series.b_values()},
               {"directions", session.series.directions().size()},
               {"volumes", session.series.volumes.size()},
               {"slices", session.series.slices.size()},
               {"encoding", session.series.encoding},
               {"outliers", outliers_json(session)},
               {"axis_check", axes_json(session)},
               {"tensors", session.tensors.voxels.size()},
               {"not_positive", session.tensors.not_positive},
               {"sigma", session.tensors.sigma},
               {"snr", session.snr},
               {"md_um2_ms", session.md},
               {"fa", session.fa},
               {"fa_of_noise", session.fa_of_noise},
               {"rms_deg", nullptr}};
  if (session.field) {
    json["rms_deg"] = session.field->rms_deg;
    json["sigma_deg"] = session.sigma_deg;
    json["wall_voxels"] = session.field->voxels;
    json["noise_scale"] = session.field->noise_scale;
    json["freedom"] = session.field->freedom;
    json["iterations"] = session.field->iterations;
    json["converged"] = session.field->converged;
    json["points"] = session.rows.size();
  }
  json["problems"] = written(session.findings);
  json["seconds"] = seconds;
  return json;
}

void print_for_people(const imaging::FibreSession& session, double seconds) {
  fmt::print("{}: {} volumes of {} slices, {} directions, b up to {:.0f} s/mm\u00b2 by {}\n",
             session.series.name, session.series.volumes.size(), session.series.slices.size(),
             session.series.directions().size(), session.series.b_values().back(), session.series.encoding);
  fmt::print(
      "{} tensors; in the middle an SNR of {:.0f}, MD {:.3f}e-3 mm\u00b2/s, FA {:.3f} of which noise alone "
      "makes "
      "{:.3f}\n",
      session.tensors.voxels.size(), session.snr, session.md, session.fa, session.fa_of_noise);
  if (session.axes)
    fmt::print("Gradient axes: {}; fibres at one depth agree by {:.2f}\n", session.axes->chosen.name,
               session.axes->chosen.agreement);
  if (session.field)
    fmt::print(
        "Fibre field of {} voxels: standard error {:.1f} degrees in the middle; single voxels lie {:.1f} "
        "degrees RMS "
        "from it\n",
        session.field->voxels, session.sigma_deg, session.field->rms_deg);
  print_findings(session.findings, stdout);
  fmt::print("In {:.1f} s\n", seconds);
}

/// All that is wrong on the command line, and with output files, before anything is read.
imaging::FibreSessionRequest checked(const FibresArguments& a) {
  imaging::FibreSessionRequest request = a.session;
  if (a.study && a.mesh) throw InputError({"", "--study, --mesh", "are two ventricles", "Give one of them."});
  const bool has_wall = a.study || a.mesh;
  if (a.output && !has_wall)
    throw InputError(
        {"", "-o", "needs a ventricle for the fibres to be a field on",
         "Give --mesh NAME.mesh (patient coordinates) or --study STUDY; tensors alone need neither: "
         "--tensors FILE.csv."});
  if (!a.output && !a.tensors && !a.page && !a.record && !a.grid)
    throw InputError({"", "-o", "is missing: nothing would be written",
                      "Give -o NAME.fibres.csv with --mesh or --study, or --tensors FILE.csv."});
  for (const auto& [option, given] :
       {std::pair{"--at", request.at.has_value()}, std::pair{"--grid", a.grid.has_value()}})
    if (given && !has_wall)
      throw InputError({"", option, "needs a ventricle", "Give --mesh NAME.mesh or --study STUDY."});
  if (a.axes != "auto") {
    request.axes = imaging::axis_change_named(a.axes);
    if (!request.axes)
      throw InputError(
          {"", "--axes " + a.axes, "is no change of axes",
           "Give auto, as-said, an axis that is reversed (x, y or z), or three signed axes such as -y+x+z."});
  }
  std::vector<fs::path> inputs;
  for (const auto& input : {a.study, a.mesh, request.at})
    if (input) inputs.push_back(*input);
  RequiredOutputs outputs(inputs, a.force);
  outputs.add(a.output, fibre_points_mark);
  outputs.add(a.tensors, imaging::tensor_file_mark);
  outputs.add(a.page, report::page_mark);
  outputs.add(a.record, fibres_record_mark);
  outputs.add(a.grid, vtkhdf_kind.mark);
  return request;
}

/// In patient coordinates.
std::optional<HermiteMesh> wall_of(const FibresArguments& a) {
  if (a.mesh) return read_mesh_file(*a.mesh).mesh;
  if (!a.study) return std::nullopt;
  Study study = read_study(*a.study);
  study.fibres.reset();  // what this command is to find
  return placed(study_body(study).mesh, placement_of(study));
}

ExitCode run_fibres(const FibresArguments& arguments, const CommandOutput& out) {
  const auto start = std::chrono::steady_clock::now();
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  const imaging::FibreSessionRequest request = checked(arguments);
  const imaging::FibreSession session =
      imaging::measure_fibres(request, wall_of(arguments), [&](const std::string& stage) {
        if (shows_progress) fmt::print(stderr, "{}\n", stage);
      });
  if (arguments.output) write_whole_file(*arguments.output, fibre_points_text(session.rows));
  if (arguments.tensors) write_whole_file(*arguments.tensors, imaging::tensor_file_text(session.tensors));
  if (arguments.grid) write_vtkhdf(*arguments.grid, imaging::fibre_grid(*session.field));
  write_page_and_record(arguments.page, arguments.record, [&] { return imaging::fibres_record(session); });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const ExitCode end = session.field && !session.field->converged ? ExitCode::negative : ExitCode::done;
  if (out.json) {
    std::cout << json_text(to_json(session, seconds), 1) << '\n';
    return end;
  }
  print_for_people(session, seconds);
  if (arguments.output)
    fmt::print("Fibres: {}; in a study: [specimen] fibres = \"{}\"\n", arguments.output->string(),
               arguments.output->filename().string());
  if (arguments.tensors) fmt::print("Tensors: {}\n", arguments.tensors->string());
  if (arguments.grid) fmt::print("For ParaView: {}\n", arguments.grid->string());
  if (arguments.page) fmt::print("The page to look at: {}\n", arguments.page->string());
  return end;
}

}  // namespace

void add_fibres(CommandLine& line) {
  auto arguments = std::make_shared<FibresArguments>();
  CLI::App* command = line.add(
      "fibres", "tensors and the fibre field of a ventricle with errors, from a scanner's diffusion series",
      "  diastole fibres dicom/ --mesh heart.mesh -o heart.fibres.csv --page heart.html\n"
      "      the mesh lies in the images' patient coordinates, as one that is fitted to images of the "
      "session does\n"
      "  diastole fibres dicom/ --study heart.study.toml -o heart.fibres.csv\n"
      "      the study's ventricle, placed by its [images.to_specimen]; then in the study:\n"
      "      [specimen] fibres = \"heart.fibres.csv\"\n"
      "  diastole fibres dicom/ --tensors gel.tensors.csv --json\n"
      "      tensors alone, of any specimen\n"
      "  diastole fibres nifti/ --mesh heart.mesh --at places.csv -o places.fibres.csv\n"
      "A folder holds DICOM files, or NAME.nii(.gz) with NAME.bval and NAME.bvec. docs/fibres.md says how it "
      "is measured.");
  FibresArguments& a = *arguments;
  imaging::FibreSessionRequest& session = a.session;
  command->add_option("FOLDER", session.folder, "the folder with the scanner's files")->required();
  command->add_option("-o,--output", a.output, "the field's directions at points (*.fibres.csv)");
  command->add_option("--mesh", a.mesh, "the ventricle's mesh in patient coordinates");
  command->add_option("--study", a.study, "a study whose specimen is the ventricle");
  command->add_option("--at", session.at,
                      "places x_mm,y_mm,z_mm at which -o gives the field, instead of all over the mesh");
  command->add_option("--tensors", a.tensors, "every voxel's tensor, patient axes (*.csv)");
  command->add_option("--page", a.page,
                      "a page to look at: tensors, the helix through the wall, fibres of three layers");
  command->add_option("--record", a.record, "the same as a file for `diastole report` (*.json)");
  command->add_option("--grid", a.grid, "the mesh with fibre vectors for ParaView (*.vtkhdf)");
  command->add_option("--series", session.series.series,
                      "number of the diffusion series, where there are several");
  command
      ->add_option("--axes", a.axes,
                   "gradient axes: auto corrects what the wall contradicts; as-said; x, y or z reversed; or "
                   "three signed "
                   "axes such as -y+x+z")
      ->default_val("auto");
  command->add_flag("--keep-outliers", session.keep_outliers, "fit images that lost their signal, too");
  command->add_flag(
      "--factor-two", session.factor_two,
      "S = S0 exp(-2 b gDg), Augenstein's Eq. 3: tensors are half as large; directions do not change");
  command->add_flag("--force", a.force, "replace output files that are none of this command's");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_fibres(*arguments, out); });
}

}  // namespace diastole
