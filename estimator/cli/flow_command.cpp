#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/output_files.hpp"
#include "estimator/imaging/flow/flow_files.hpp"
#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

struct FlowArguments {
  std::filesystem::path folder;
  std::filesystem::path output;
  std::optional<std::filesystem::path> run, pressure, trigger, loop;
  std::optional<size_t> segment;
  std::vector<double> centre;
  imaging::PhaseContrastRequest scan;
  imaging::FlowRequest flow;
  bool leave_background = false;
  bool force = false;
};

/// The 97.5th percentile of a normal variable: 95 % lie within.
constexpr double z95 = 1.96;

Json with_interval(const imaging::ValueWithError& value) {
  return {{"value", value.value},
          {"se", value.sigma},
          {"ci95", {value.value - z95 * value.sigma, value.value + z95 * value.sigma}}};
}

ExitCode run_flow(const FlowArguments& arguments, const CommandOutput& out) {
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::filesystem::path> inputs;
  require_output({arguments.output, inputs, imaging::flow_file_mark, arguments.force});
  const imaging::ImageFolder folder = imaging::read_image_folder(arguments.folder);
  imaging::require_sound(folder);
  imaging::FlowRequest request = arguments.flow;
  request.remove_background = !arguments.leave_background;
  if (!arguments.centre.empty()) request.centre_px = Eigen::Vector2d(arguments.centre[0], arguments.centre[1]);
  const imaging::FlowMeasurement flow =
      imaging::measure_flow(imaging::phase_contrast(folder, arguments.scan), request, arguments.folder.string());
  std::optional<imaging::PressureVolumeLoop> loop;
  if (arguments.pressure) loop = imaging::pressure_volume_loop(flow, imaging::run_of_tables(*arguments.pressure, *arguments.trigger), arguments.segment);
  write_whole_file(arguments.output, imaging::flow_file_text(flow));
  if (loop && arguments.loop) write_whole_file(*arguments.loop, imaging::loop_file_text(*loop));
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  Json json = {{"stroke_mL", with_interval(flow.stroke_mL)}, {"closure_mL", with_interval(flow.closure_mL)}, {"seconds", seconds},
   {"chi2", flow.lumen.reduced_chi_square}, {"encoding", static_cast<int>(flow.lumen.encoding)}, {"order", flow.background.order}, {"bg", flow.background.at_lumen_rad*flow.scan.cm_s_per_radian()}, {"background_cm_s", flow.background.sigma_rad*flow.scan.cm_s_per_radian()},
   {"bgchi2", flow.background.reduced_chi_square},
   {"radius", flow.lumen.scene.shape.radius_mm}, {"wall", flow.lumen.scene.shape.wall_mm}, {"ec", flow.lumen.scene.shape.ellipse_cos}, {"moves", flow.lumen.moves}, {"conv", flow.lumen.converged}, {"unwrapped", flow.unwrapped}, {"smooth", flow.flow.smoothness}, {"venc", flow.scan.venc_cm_s}, {"source", flow.scan.venc_source},{"margin", flow.lumen.turn_margin}};
  if (loop) json["work"] = with_interval(loop->work_mJ);
  std::cout << json.dump(1) << '\n';
  (void)out;
  return ExitCode::done;
}

}  // namespace

void add_flow(CommandLine& line) {
  auto arguments = std::make_shared<FlowArguments>();
  CLI::App* command = line.add("flow", "flow and volume over the cycle with errors, from a scanner's phase contrast", "");
  command->add_option("FOLDER", arguments->folder, "the folder with the scanner's files")->required();
  command->add_option("-o,--output", arguments->output, "the table to write (*.flow.csv)")->required();
  command->add_option("--pressure", arguments->pressure, "");
  command->add_option("--trigger", arguments->trigger, "");
  command->add_option("--loop", arguments->loop, "");
  command->add_option("--venc", arguments->scan.venc_cm_s, "");
  command->add_option("--centre", arguments->centre, "")->delimiter(',')->expected(2);
  command->add_flag("--close", arguments->flow.close, "");
  command->add_flag("--force", arguments->force, "");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_flow(*arguments, out); });
}

}  // namespace diastole
