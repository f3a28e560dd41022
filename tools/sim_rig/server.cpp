#include "tools/sim_rig/server.hpp"

#include <poll.h>

#include <algorithm>
#include <chrono>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace diastole::sim_rig {
namespace {

using namespace std::chrono_literals;
using WallClock = std::chrono::steady_clock;

constexpr auto longest_serial_wait = 1s;
constexpr int wall_clock_tick_ms = 1;

sim_daq::InstrumentConfig instrument_config(const RigDescription& description, const ServerOptions& options) {
  sim_daq::InstrumentConfig config;
  config.port = options.modbus_port;
  config.clock_error_ppm = description.daq_clock_error_ppm;
  config.faults = options.faults.daq;
  return config;
}

}  // namespace

Server::Server(const RigDescription& description, std::unique_ptr<SimulatedController> controller,
               const ServerOptions& options)
    : options_(options),
      line_(options.link),
      rig_(description, std::move(controller),
           {.sent = [this](std::span<const uint8_t> bytes) { line_.write(bytes); },
            .edge =
                [this](const PinEdge& edge) {
                  if (pins_) pins_->write(edge);
                  if (edge.pin == Pin::ttl && edge.value != 0) take_trigger(edge.time_ns);
                }}),
      instrument_(instrument_config(description, options),
                  {.now_ns = [this] { return rig_.now_ns(); },
                   .volts = [this](int input) { return rig_.volts(input); }}) {
  if (!options.pins.empty()) pins_.emplace(options.pins);
  if (!options.conductor.empty()) conductor_.emplace(options.conductor);
}

std::string Server::addresses() const {
  nlohmann::json document{
      {"pty", line_.path()}, {"modbus_host", "127.0.0.1"}, {"modbus_port", instrument_.port()}};
  document["conductor"] = conductor_ ? nlohmann::json(options_.conductor.string()) : nlohmann::json();
  return document.dump();
}

void Server::run(int stop_descriptor) {
  const auto start = WallClock::now();
  while (true) {
    line_.refresh();
    std::vector<pollfd> waiting{{stop_descriptor, POLLIN, 0},
                                {conductor_ ? conductor_->descriptor() : -1, POLLIN, 0},
                                {line_.descriptor(), POLLIN, 0}};
    for (const int fd : instrument_.descriptors())
      waiting.push_back({fd, POLLIN, 0});
    ::poll(waiting.data(), waiting.size(), conductor_ ? -1 : wall_clock_tick_ms);
    if (waiting[0].revents != 0) break;
    if (!conductor_) {
      advance_to(static_cast<uint64_t>(std::chrono::nanoseconds(WallClock::now() - start).count()));
    }
    take_serial();
    if (waiting[1].revents != 0) {
      if (const auto question = conductor_->receive()) conduct(*question);
    }
    instrument_.service();
  }
  if (pins_) pins_->close();
}

void Server::advance_to(uint64_t until_ns) {
  if (until_ns >= options_.faults.serial_hangup_ns) {
    rig_.advance_to(options_.faults.serial_hangup_ns);
    line_.hang_up();
  }
  rig_.advance_to(until_ns);
}

void Server::take_trigger(uint64_t time_ns) {
  if (!std::exchange(triggered_, true)) instrument_.plan(options_.faults.daq_from_ttl, time_ns);
}

void Server::take_serial() {
  line_.refresh();
  rig_.receive(line_.read());
  line_.send_queued();
}

void Server::conduct(const conductor::Advance& question) {
  take_serial();
  if (question == conductor::Advance{}) line_.restart_counts();
  const auto give_up = WallClock::now() + longest_serial_wait;
  while (line_.received_total() < question.serial_bytes_written_total && line_.descriptor() >= 0 &&
         WallClock::now() < give_up) {
    pollfd serial{line_.descriptor(), POLLIN, 0};
    ::poll(&serial, 1, 10);
    take_serial();
  }
  advance_to(question.until_ns);
  conductor_->answer({rig_.now_ns(), line_.sent_total()});
}

}  // namespace diastole::sim_rig
