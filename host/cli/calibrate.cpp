// `diastole zero` and `diastole calibrate`: what the channels read at rest, measured by the daemon.

#include <fmt/format.h>

#include <cstdlib>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/cli/daemon_question.hpp"
#include "host/cli/host_commands.hpp"
#include "host/rpc/client.hpp"

namespace diastole {
namespace {

using nlohmann::json;

std::string user() {
  const char* name = std::getenv("USER");
  return name == nullptr ? "" : name;
}

struct MeasurementOptions {
  DaemonAddress daemon;
  std::vector<std::string> channels;
  double kPa = 0;
  double seconds = 5;
  std::string operator_name = user();
};

void add_common(CLI::App& command, MeasurementOptions& options) {
  command.add_option("--seconds", options.seconds, "how long to average (1 to 600)")->capture_default_str();
  command.add_option("--operator", options.operator_name, "who does it, for the run files")
      ->capture_default_str();
  options.daemon.add_to(command);
  options.daemon.add_take_over_to(command);
}

ExitCode measure(const MeasurementOptions& options, const std::string& method, json params, bool as_json) {
  params["channels"] = options.channels;
  params["seconds"] = options.seconds;
  params["operator"] = options.operator_name;
  const auto timeout = std::chrono::seconds(static_cast<int>(options.seconds) + 30);
  DaemonClient daemon = options.daemon.connect();
  const json result = daemon.call(method, params, timeout);
  if (as_json) {
    print_json(result);
    return ExitCode::done;
  }
  for (const json& channel : result.at("channels")) {
    fmt::print("{}: {:.5f} V from {} samples, noise {:.3f} kPa, drift {:+.3f} kPa\n",
               channel.at("name").get<std::string>(), channel.at("mean_V").get<double>(),
               channel.at("samples").get<int64_t>(), channel.at("noise_kPa").get<double>(),
               channel.at("drift_kPa").get<double>());
    if (method == "rig.calibrate" && channel.at("points") == 1) {
      fmt::print("  one point; apply another pressure and give it with --kPa to calibrate\n");
      continue;
    }
    fmt::print("  pressure = (V - {:.5f}) x {:.5f} kPa/V\n", channel.at("zero_V").get<double>(),
               channel.at("kPa_per_V").get<double>());
  }
  const std::string file = result.at("file");
  fmt::print("{}\n", file.empty() ? "kept until the daemon ends: the rig is simulated" : "kept in " + file);
  return ExitCode::done;
}

}  // namespace

void add_zero(CommandLine& line) {
  auto options = std::make_shared<MeasurementOptions>();
  CLI::App* command =
      line.add("zero", "call what the pressure channels read now, at rest, zero",
               "  diastole zero --operator \"A. Nguyen\"\n"
               "      averages all channels for 5 s; refuses when they are not at rest\n"
               "  diastole zero cavity --seconds 20\n"
               "The result stays in a file beside the rig file and goes into every run file.");
  command->add_option("CHANNEL", options->channels, "channels to zero; all if none is named");
  add_common(*command, *options);
  line.on_run(command, [options](const CommandOutput& out) {
    return measure(*options, "rig.zero", json::object(), out.json);
  });
}

void add_calibrate(CommandLine& line) {
  auto options = std::make_shared<MeasurementOptions>();
  CLI::App* command = line.add(
      "calibrate", "calibrate a pressure channel at two known pressures",
      "  diastole calibrate cavity --kPa 0 --operator \"A. Nguyen\"\n"
      "      open the transducer to air, and give the first point\n"
      "  diastole calibrate cavity --kPa 9.81 --operator \"A. Nguyen\"\n"
      "      apply a water column of 1 m, and give the second: the channel is calibrated\n"
      "Each point averages 5 s at rest. The result stays in a file beside the rig file, with date and\n"
      "operator, and goes into every run file.");
  command->add_option("CHANNEL", options->channels, "channel")->required()->expected(1);
  command->add_option("--kPa", options->kPa, "the pressure that is applied")->required();
  add_common(*command, *options);
  line.on_run(command, [options](const CommandOutput& out) {
    return measure(*options, "rig.calibrate", {{"kPa", options->kPa}}, out.json);
  });
}

}  // namespace diastole
