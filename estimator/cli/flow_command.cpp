#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/cli/page_and_record.hpp"
#include "estimator/imaging/flow/flow_files.hpp"
#include "estimator/imaging/flow/flow_session.hpp"
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
using inference::normal_95;

struct FlowArguments {
  imaging::FlowSessionRequest session;
  fs::path output;
  std::vector<double> centre;
  bool leave_background = false;
  bool leave_run = false;
  std::optional<fs::path> loop, page, record;
  bool force = false;
};

Json with_interval(const imaging::ValueWithError& value) {
  return {{"value", value.value},
          {"se", value.sigma},
          {"ci95", {value.value - normal_95 * value.sigma, value.value + normal_95 * value.sigma}}};
}

Json background_json(const imaging::FlowMeasurement& flow) {
  const double cm_s = flow.scan.cm_s_per_radian();
  if (flow.background.order < 0) return {{"order", nullptr}};
  return {{"order", flow.background.order},
          {"at_lumen_cm_s", cm_s * flow.background.at_lumen_rad},
          {"still_pixels", flow.background.pixels},
          {"reduced_chi_square", flow.background.reduced_chi_square}};
}

Json lumen_json(const imaging::FlowMeasurement& flow) {
  const imaging::LumenShape& shape = flow.lumen.scene.shape;
  const Eigen::Vector3d centre = flow.scan.plane.at(shape.centre_mm);
  return {
      {"centre_mm", {centre.x(), centre.y(), centre.z()}},
      {"centre_px",
       {shape.centre_mm.x() / flow.scan.plane.column_spacing_mm,
        shape.centre_mm.y() / flow.scan.plane.row_spacing_mm}},
      {"radius_mm", shape.radius_mm},
      {"area_mm2", flow.lumen.area_mm2},
      {"wall_mm", shape.wall_mm},
      {"movement_mm", flow.lumen.movement_mm},
      {"encoding", flow.lumen.encoding == imaging::Encoding::separate ? "reference and encoded" : "balanced"},
      {"reduced_chi_square", flow.lumen.reduced_chi_square}};
}

Json to_json(const imaging::FlowSession& session, double seconds) {
  const imaging::FlowMeasurement& flow = session.flow;
  Json json = {{"stroke_mL", with_interval(flow.stroke_mL)},
               {"background_cm_s", flow.background.order < 0
                                       ? Json(nullptr)
                                       : Json(flow.background.sigma_rad * flow.scan.cm_s_per_radian())},
               {"unwrapped", flow.unwrapped},
               {"closure_mL", with_interval(flow.closure_mL)},
               {"closed", flow.is_closed},
               {"venc_cm_s", flow.scan.venc_cm_s},
               {"venc_source", flow.scan.venc_source},
               {"interval_s", flow.interval_s()},
               {"background", background_json(flow)},
               {"lumen", lumen_json(flow)}};
  json["phases"] = Json::array();
  for (const imaging::PhaseFlow& phase : flow.phases)
    json["phases"].push_back({{"phase_s", phase.phase_s},
                              {"flow_mL_s", phase.flow_mL_s.value},
                              {"flow_sigma_mL_s", phase.flow_mL_s.sigma},
                              {"volume_mL", phase.volume_mL.value},
                              {"volume_sigma_mL", phase.volume_mL.sigma},
                              {"core_cm_s", phase.core_cm_s},
                              {"turns", phase.turns}});
  if (session.loop) {
    const imaging::PressureVolumeLoop& loop = *session.loop;
    json["loop"] = {{"work_mJ", with_interval(loop.work_mJ)},
                    {"points", loop.points.size()},
                    {"segment", loop.segment},
                    {"gate_every", loop.gate_every},
                    {"cycles", loop.cycles},
                    {"delay_removed_s", loop.delay_s},
                    {"pressure", loop.source}};
  }
  json["problems"] = written(session.findings);
  json["seconds"] = seconds;
  return json;
}

std::string value_with_error(const imaging::ValueWithError& value, const char* unit) {
  return fmt::format("{:.3f} {} (95 % interval {:.3f} to {:.3f})", value.value, unit,
                     value.value - normal_95 * value.sigma, value.value + normal_95 * value.sigma);
}

void print_for_people(const imaging::FlowSession& session, double seconds) {
  const imaging::FlowMeasurement& flow = session.flow;
  const double cm_s = flow.scan.cm_s_per_radian();
  fmt::print("{}: {} phases of a cycle of {:.4g} s, venc {:.4g} cm/s by {}\n", flow.scan.name,
             flow.scan.phases(), flow.interval_s(), flow.scan.venc_cm_s, flow.scan.venc_source);
  fmt::print("Lumen of {:.1f} mm\u00b2, {}; background {}\n", flow.lumen.area_mm2,
             flow.lumen.moves ? fmt::format("moving by {:.2f} mm RMS", flow.lumen.movement_mm)
                              : std::string("at rest"),
             flow.background.order < 0
                 ? std::string("not known")
                 : fmt::format("{:.2f} cm/s taken off, known to {:.2f} cm/s",
                               cm_s * flow.background.at_lumen_rad, cm_s * flow.background.sigma_rad));
  if (flow.unwrapped > 0)
    fmt::print("Velocities beyond the venc: whole turns put back in {} phases\n", flow.unwrapped);
  fmt::print("\nStroke volume {}\n", value_with_error(flow.stroke_mL, "mL"));
  fmt::print("A cycle does not return {}{}\n", value_with_error(flow.closure_mL, "mL"),
             flow.is_closed ? "; corrected" : "; --close corrects it");
  if (session.loop)
    fmt::print("Work of a cycle {}, pressure of {} cycles\n", value_with_error(session.loop->work_mJ, "mJ"),
               session.loop->cycles);
  print_findings(session.findings, stdout);
  fmt::print("In {:.1f} s\n", seconds);
}

/// All that is wrong on the command line, and with output files, before anything is read.
imaging::FlowSessionRequest checked(const FlowArguments& arguments) {
  imaging::FlowSessionRequest request = arguments.session;
  if (request.pressure.has_value() != request.trigger.has_value())
    throw InputError(
        {"", request.pressure ? "--pressure" : "--trigger", "stands alone",
         "A pressure table needs the triggers' and the reverse: --pressure P.csv --trigger T.csv."});
  if (request.run && request.pressure)
    throw InputError({"", "--run, --pressure", "are two pressures", "Give one of them."});
  if (arguments.loop && !request.run && !request.pressure)
    throw InputError({"", "--loop", "needs a pressure", "Give --run RUN.h5, or --pressure and --trigger."});
  request.flow.remove_background = !arguments.leave_background;
  if (!arguments.centre.empty())
    request.flow.centre_px = Eigen::Vector2d(arguments.centre[0], arguments.centre[1]);
  std::vector<fs::path> inputs;
  for (const auto& input : {request.run, request.pressure, request.trigger})
    if (input) inputs.push_back(*input);
  RequiredOutputs outputs(inputs, arguments.force);
  outputs.add(arguments.output, imaging::flow_file_mark);
  outputs.add(arguments.loop, imaging::loop_file_mark);
  outputs.add(arguments.page, report::page_mark);
  outputs.add(arguments.record, flow_record_mark);
  return request;
}

ExitCode run_flow(const FlowArguments& arguments, const CommandOutput& out) {
  const auto start = std::chrono::steady_clock::now();
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  const imaging::FlowSessionRequest request = checked(arguments);
  const imaging::FlowSession session = imaging::measure_session(request, [&](const std::string& stage) {
    if (shows_progress) fmt::print(stderr, "{}\n", stage);
  });
  // The run first: if it cannot take the volume, nothing is written.
  if (request.run && !arguments.leave_run) imaging::store_in_run(session, *request.run, arguments.force);
  write_whole_file(arguments.output, imaging::flow_file_text(session.flow));
  if (arguments.loop) write_whole_file(*arguments.loop, imaging::loop_file_text(*session.loop));
  write_page_and_record(arguments.page, arguments.record, [&] { return imaging::flow_record(session); });
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  if (out.json) {
    std::cout << json_text(to_json(session, seconds), 1) << '\n';
    return ExitCode::done;
  }
  print_for_people(session, seconds);
  fmt::print("Flow and volume: {}\n", arguments.output.string());
  if (arguments.loop) fmt::print("Loop: {}\n", arguments.loop->string());
  if (request.run && !arguments.leave_run)
    fmt::print("The volume is in {} as /mr/flow/{}: `diastole explain` uses it\n", request.run->string(),
               session.loop->segment);
  if (arguments.page) fmt::print("The page to look at: {}\n", arguments.page->string());
  return ExitCode::done;
}

}  // namespace

void add_flow(CommandLine& line) {
  auto arguments = std::make_shared<FlowArguments>();
  CLI::App* command = line.add(
      "flow",
      "flow and volume over the cycle with errors, from a scanner's phase contrast; with a run the p-V loop",
      "  diastole flow dicom/ -o heart.flow.csv\n"
      "  diastole flow dicom/ -o heart.flow.csv --page heart.html\n"
      "  diastole flow dicom/ -o heart.flow.csv --run heart.run.h5 --loop heart.loop.csv --page heart.html\n"
      "      the loop with the run's pressure; the volume goes into the run too, where `diastole explain` "
      "reads it\n"
      "  diastole flow dicom/ -o heart.flow.csv --pressure p.csv --trigger t.csv --loop heart.loop.csv\n"
      "      the same with tables time_s,cavity_kPa and time_s\n"
      "  diastole flow dicom/ -o heart.flow.csv --venc 100 --centre 52,47 --json\n"
      "Flow is positive along the slice's normal (rows x columns), or against it with --reverse. "
      "docs/flow.md says how it is measured.");
  FlowArguments& a = *arguments;
  imaging::FlowSessionRequest& session = a.session;
  command->add_option("FOLDER", session.folder, "the folder with the scanner's files")->required();
  command->add_option("-o,--output", a.output, "flow and volume of each image phase (*.flow.csv)")
      ->required();
  auto* run = command->add_option(
      "--run", session.run,
      "the run that was recorded with the scan: its pressure gives the loop, and it gets the volume");
  command->add_option("--segment", session.segment,
                      "segment of the run, from 0; default: the first with triggers");
  command->add_option("--pressure", session.pressure,
                      "pressure as a table time_s,cavity_kPa, instead of a run");
  command->add_option("--trigger", session.trigger, "its triggers as a table time_s");
  command->add_flag("--leave-run", a.leave_run, "do not write the volume into the run")->needs(run);
  command->add_option("--loop", a.loop, "the pressure-volume loop with stiffness (*.loop.csv)");
  command->add_option("--page", a.page,
                      "a page to look at: flow, volume, loop, images with the lumen's outline");
  command->add_option("--record", a.record, "the same as a file for `diastole report` (*.json)");
  command->add_option("--venc", session.scan.venc_cm_s, "velocity encoding in cm/s, instead of the headers'")
      ->check(positive_number);
  command
      ->add_option("--period", session.scan.interval_s,
                   "time after which the flow repeats in s, instead of the headers' interval")
      ->check(positive_number);
  command->add_option("--series", session.scan.series,
                      "number of the velocity series, where there are several");
  command->add_option("--slice", session.scan.slice, "slice of it, from 1, where there are several");
  command
      ->add_option("--centre", a.centre,
                   "COLUMN,ROW of a pixel (from 0) in the lumen, where the largest is not the one")
      ->delimiter(',')
      ->expected(2);
  command->add_flag("--bridge-gaps", session.scan.bridge_gaps, "go across phases that are missing");
  command->add_flag("--reverse", session.scan.reverse,
                    "the slice's normal points out of the specimen: count flow against it as positive");
  command->add_flag("--leave-background", a.leave_background,
                    "do not take off the phase that still material shows");
  command->add_flag("--close", session.flow.close,
                    "correct the flow so that a cycle returns: the likeliest curve that does");
  command->add_flag("--force", a.force, "replace output files that are none of flow's, and the run's volume");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_flow(*arguments, out); });
}

}  // namespace diastole
