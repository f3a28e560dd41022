#include "tests/flow/rig_with_daemon.hpp"

#include <gtest/gtest.h>

#include <csignal>
#include <thread>

#include "host/rpc/json_rpc.hpp"
#include "host/transport/unix_socket.hpp"

namespace diastole::flow {

using namespace std::chrono_literals;
using nlohmann::json;

RigWithDaemon::RigWithDaemon(Time time, const std::string& rig_file,
                             const std::vector<std::string>& rig_options)
    : time_(time) {
  place.write("rig.toml", time == Time::real ? with_longest_lease(rig_file) : rig_file);
  std::vector<std::string> rig{"sim_rig",        "--link",    path("pump"),   "--config",
                               path("rig.toml"), "--control", path("control")};
  if (time == Time::conducted) rig.insert(rig.end(), {"--conductor", path("time")});
  rig.insert(rig.end(), rig_options.begin(), rig_options.end());
  rig_ = std::make_unique<Program>(place, rig);
  EXPECT_TRUE(rig_->wait_for_text("modbus_port")) << rig_->err();
  modbus_port_ = json::parse(rig_->out())["modbus_port"];
}

RigWithDaemon::~RigWithDaemon() {
  for (const auto* program : {&daemon, &rig_}) {
    if (*program == nullptr) continue;
    (*program)->signal(SIGTERM);
    EXPECT_EQ((*program)->wait().exit_code, 0) << (*program)->err();
  }
}

void RigWithDaemon::end_rig() {
  rig_->signal(SIGTERM);
  EXPECT_EQ(rig_->wait().exit_code, 0) << rig_->err();
  rig_.reset();
}

void RigWithDaemon::start_daemon(const std::vector<std::string>& before) {
  std::vector<std::string> arguments = before;
  arguments.push_back(before.empty() ? "diastole" : DIASTOLE_BIN_DIR "/diastole");
  arguments.insert(arguments.end(), {"daemon", "--config", "rig.toml", "--port", path("pump"), "--daq",
                                     "127.0.0.1:" + std::to_string(modbus_port_), "--socket", path("socket"),
                                     "--journal-dir", "journals"});
  if (time_ == Time::conducted) arguments.insert(arguments.end(), {"--conductor", path("time")});
  arguments.insert(arguments.end(), daemon_options.begin(), daemon_options.end());
  daemon = std::make_unique<Program>(place, arguments);
  ASSERT_TRUE(daemon->wait_for_text("ready")) << daemon->err();
}

json many_segments() {
  std::string text = "format = \"diastole-experiment\"\nversion = 1\nrest_s = 0.2\n";
  for (int i = 0; i < 60; ++i)
    text += "[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 2.0\nperiod_s = 0.3\n";
  return {{"experiment", text}, {"file", "many.experiment.toml"}};
}

json status_when(DaemonClient& client, const std::string& state, bool is) {
  json status;
  for (const auto end = std::chrono::steady_clock::now() + 30s; std::chrono::steady_clock::now() < end;) {
    status = client.call("rig.status");
    if ((status["state"] == state) == is) return status;
    std::this_thread::sleep_for(1ms);
  }
  ADD_FAILURE() << "still " << status.dump();
  return status;
}

json home(DaemonClient& client) {
  json status = client.call("rig.home");
  client.call("control.release");
  return status;
}

Hasty::Hasty(const std::string& socket, const std::string& method, const json& params)
    : socket_(connect_unix_socket(socket)) {
  const std::string line = rpc::request_line(1, method, params);
  EXPECT_EQ(::send(socket_.get(), line.data(), line.size(), MSG_NOSIGNAL), static_cast<ssize_t>(line.size()));
}

}  // namespace diastole::flow
