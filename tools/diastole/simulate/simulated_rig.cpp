#include "tools/diastole/simulate/simulated_rig.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "host/config/rig_config.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/sim_rig/rig_description.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr auto start_timeout = 30s;
constexpr auto stop_timeout = 20s;

std::string program_beside(const std::string& name) {
  return fs::read_symlink("/proc/self/exe").parent_path() / name;
}

/// The rig file for both programs, checked here so that its faults are reported as those of input.
std::string rig_file(const PrivateDirectory& directory, const std::string& given) {
  const std::string path = given.empty() ? (directory / "rig.toml").string() : given;
  if (given.empty()) std::ofstream(path) << sim_rig::default_rig_toml();
  read_rig(path);
  sim_rig::read_rig_description(TableReader::from_file(path));
  return path;
}

}  // namespace

PrivateDirectory::PrivateDirectory() {
  std::string pattern = (fs::temp_directory_path() / "diastole-XXXXXX").string();
  if (::mkdtemp(pattern.data()) == nullptr) {
    throw InputError(
        {pattern, "", "no directory can be made there", "Set TMPDIR to a directory in which you may write."});
  }
  path_ = pattern;
}

PrivateDirectory::~PrivateDirectory() {
  std::error_code ignored;
  if (!kept_) fs::remove_all(path_, ignored);
}

SimulatedRig::SimulatedRig(const PrivateDirectory& directory, const SimulatedRigOptions& options)
    : directory_(directory) {
  const std::string config = rig_file(directory, options.config);
  const std::string line = directory / "pump";
  const std::string conductor = directory / "time";
  std::vector<std::string> rig{program_beside("sim_rig"),   "--config", config, "--link", line, "--seed",
                               fmt::to_string(options.seed)};
  if (!options.image.empty()) rig.insert(rig.end(), {"--image", options.image});
  if (!options.pins.empty()) rig.insert(rig.end(), {"--pins", options.pins});
  if (!options.real_time) rig.insert(rig.end(), {"--conductor", conductor});
  rig.insert(rig.end(), options.more.begin(), options.more.end());
  rig_ = std::make_unique<ChildProcess>(rig, directory / "sim_rig.log");
  const auto addresses = nlohmann::json::parse(rig_->first_line(start_timeout));

  const std::string daq = fmt::format("{}:{}", addresses.at("modbus_host").get<std::string>(),
                                      addresses.at("modbus_port").get<int>());
  std::vector<std::string> daemon{fs::read_symlink("/proc/self/exe"), "daemon", "--config", config};
  daemon.insert(daemon.end(), {"--port", line, "--daq", daq, "--socket", socket()});
  daemon.insert(daemon.end(), {"--journal-dir", directory / "journals"});
  if (!options.real_time) daemon.insert(daemon.end(), {"--conductor", conductor});
  daemon_ = std::make_unique<ChildProcess>(daemon, directory / "daemon.log");
  daemon_->first_line(start_timeout);
}

void SimulatedRig::stop() {
  daemon_->stop(stop_timeout);
  if (const int code = rig_->stop(stop_timeout); code != 0) {
    throw HardwareError("sim_rig", fmt::format("ended with code {}: {}", code, rig_->said()),
                        "Check the room where the pin trace is written.");
  }
}

}  // namespace diastole
