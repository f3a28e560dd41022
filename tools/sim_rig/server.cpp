#include "tools/sim_rig/server.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>
#include <vector>

#include "host/transport/real_time.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::sim_rig {
namespace {

using namespace std::chrono_literals;
using WallClock = std::chrono::steady_clock;

constexpr auto longest_serial_wait = 1s;
constexpr int wall_clock_tick_ms = 1;
constexpr uint64_t origin_step_ns = 1'000'000;
constexpr uint64_t longest_leap_ns = 5'000'000;
constexpr int hardware_priority = 30;  // below the daemon's, which has to answer it

sim_daq::InstrumentConfig instrument_config(const RigDescription& description, const ServerOptions& options) {
  sim_daq::InstrumentConfig config;
  config.port = options.modbus_port;
  config.clock_error_ppm = description.daq_clock_error_ppm;
  return config;
}

/// What a clock that runs `ppm` fast gains until `time_ns`, to the nearest ns.
int64_t gained_ns(uint64_t time_ns, double ppm) {
  return std::llround(static_cast<long double>(time_ns) * static_cast<long double>(ppm) * 1e-6L);
}

}  // namespace

Server::Server(const RigDescription& description,
               std::unique_ptr<sim_controller::SimulatedController> controller, const ServerOptions& options)
    : options_(options),
      daq_timeout_ns_(description.daq_timeout_ns),
      cables_(options.link),
      rig_(description, std::move(controller),
           {.sent = [this](std::span<const uint8_t> bytes) { take_sent(bytes); },
            .edge = [this](const sim_controller::PinEdge& edge) { take_edge(edge); }}),
      instrument_(
          instrument_config(description, options),
          {.now_ns = [this] { return rig_.now_ns(); },
           .volts = [this](int input) { return playback_ ? playback_->volts(input) : rig_.volts(input); },
           .reading_fails =
               [this] {
                 if (!playback_) return false;
                 playback_->sample(rig_.now_ns(), run_clock_.run_start_ns());
                 return playback_->missing();
               },
           .wait = [this](uint64_t late_ns) { return let_wait(late_ns); }}) {
  timeline_.plan(options.faults);
  if (!options.play.empty()) playback_.emplace(options.play, description.channels);
  if (!options.pins.empty()) pins_.emplace(options.pins);
  if (!options.volume.empty()) volume_.emplace(options.volume);
  if (!options.conductor.empty()) conductor_.emplace(options.conductor);
  if (!options.control.empty()) control_.emplace(options.control);
}

std::string Server::addresses() const {
  nlohmann::json document{
      {"pty", cables_.line.path()}, {"modbus_host", "127.0.0.1"}, {"modbus_port", instrument_.port()}};
  document["conductor"] = conductor_ ? nlohmann::json(options_.conductor.string()) : nlohmann::json();
  document["control"] = control_ ? nlohmann::json(options_.control.string()) : nlohmann::json();
  return json_text(document);
}

void Server::run(int stop_descriptor) {
  const auto start = WallClock::now();
  if (!conductor_) ask_for_real_time(hardware_priority);  // hardware is never late
  while (true) {
    cables_.line.refresh();
    std::vector<pollfd> waiting{{stop_descriptor, POLLIN, 0},
                                {conductor_ && !held_ ? conductor_->descriptor() : -1, POLLIN, 0},
                                {conducted() ? -1 : cables_.line.descriptor(), POLLIN, 0}};
    for (const int fd : instrument_.descriptors())
      waiting.push_back({fd, POLLIN, 0});
    if (control_) {
      for (const int fd : control_->descriptors())
        waiting.push_back({fd, POLLIN, 0});
    }
    ::poll(waiting.data(), waiting.size(), conductor_ ? -1 : wall_clock_tick_ms);
    if (waiting[0].revents != 0) break;
    if (!conductor_) {
      catch_up(static_cast<uint64_t>(std::chrono::nanoseconds(WallClock::now() - start).count()));
      while (const auto hold = timeline_.take_hold(run_clock_, rig_.now_ns()))
        control_->send(hold->client, "held " + hold->moment);
    }
    if (!conducted()) take_serial();  // otherwise with the question that says how much was written
    if (waiting[1].revents != 0) {
      if (const auto question = conductor_->receive()) conduct(*question);
    }
    if (control_) {
      control_->service([this](int client, const std::string& order) { return obey(client, order); });
      if (held_ && !control_->connected(held_->by)) hold_or_answer(std::exchange(held_, {})->answer);
    }
    instrument_.service();
  }
  if (pins_) pins_->close();
}

/// In short leaps, so that a rig that was kept from the processor still hears the host's answers in between.
void Server::catch_up(uint64_t until_ns) {
  while (rig_.now_ns() < until_ns) {
    advance_to(std::min(until_ns, rig_.now_ns() + longest_leap_ns));
    take_serial();
  }
}

void Server::advance_to(uint64_t until_ns) {
  while (true) {
    // Step by step as long as the moment of a switch may become known on the way.
    const uint64_t next_ns =
        timeline_.awaits_origin(run_clock_) ? std::min(until_ns, rig_.now_ns() + origin_step_ns) : until_ns;
    while (const auto due = timeline_.take_switch(run_clock_, next_ns)) {
      rig_.advance_to(due->time_ns);
      set(*due->what.kind, due->what.value);
    }
    rig_.advance_to(next_ns);
    if (volume_) volume_->take(rig_.now_ns(), rig_.plant().cavity_mL());
    if (next_ns >= until_ns) return;
  }
}

void Server::set(const FaultKind& kind, std::optional<double> value) {
  FaultTarget rig{rig_, instrument_, cables_};
  kind.set(rig, value);
  faults_on_.erase(kind.name);
  if (value) faults_on_[kind.name] = *value;
}

void Server::take_sent(std::span<const uint8_t> bytes) {
  run_clock_.observe(bytes, rig_.controller().tick_zero_ns());
  if (cables_.to_host) cables_.line.write(bytes);
}

void Server::take_edge(const sim_controller::PinEdge& edge) {
  if (edge.pin == sim_controller::Pin::ttl && edge.value != 0) run_clock_.trigger(edge.time_ns);
  if (volume_ && edge.pin == sim_controller::Pin::ttl && edge.value != 0) volume_->begin_cycle(edge.time_ns);
  const bool to_scanner = edge.pin == sim_controller::Pin::ttl || edge.pin == sim_controller::Pin::rwave_uV;
  if (pins_ && (cables_.to_scanner || !to_scanner)) pins_->write(edge);
}

void Server::take_serial() {
  cables_.line.refresh();
  const std::vector<uint8_t> bytes = cables_.line.read();
  if (cables_.from_host) rig_.receive(bytes);
  cables_.line.send_queued();
}

void Server::conduct(const conductor::Advance& question) {
  take_serial();
  if (question == conductor::Advance{}) cables_.line.restart_counts();
  const auto give_up = WallClock::now() + longest_serial_wait;
  while (cables_.line.received_total() < question.serial_bytes_written_total &&
         cables_.line.descriptor() >= 0 && WallClock::now() < give_up) {
    pollfd serial{cables_.line.descriptor(), POLLIN, 0};
    ::poll(&serial, 1, 10);
    take_serial();
  }
  const int64_t gained = gained_ns(question.until_ns, options_.host_drift_ppm);
  advance_to(question.until_ns - static_cast<uint64_t>(gained));
  hold_or_answer({std::max(host_ns(), question.until_ns), cables_.line.sent_total()});
}

/// The rig's present on the host's clock.
uint64_t Server::host_ns() const {
  return rig_.now_ns() + static_cast<uint64_t>(gained_ns(rig_.now_ns(), options_.host_drift_ppm));
}

/// A conducted daemon that waits for its instrument moves no time: it is moved for it.
sim_daq::Wait Server::let_wait(uint64_t late_ns) {
  if (!conducted()) return sim_daq::Wait::goes_on;
  advance_to(rig_.now_ns() + std::min(late_ns, daq_timeout_ns_));
  conductor_->answer({host_ns(), conductor::unsolicited});
  return late_ns < daq_timeout_ns_ ? sim_daq::Wait::is_over : sim_daq::Wait::given_up;
}

void Server::hold_or_answer(const conductor::Advanced& answer) {
  if (const auto hold = timeline_.take_hold(run_clock_, rig_.now_ns()); hold && control_) {
    held_ = HeldAnswer{answer, hold->client};
    control_->send(hold->client, "held " + hold->moment);
  } else {
    conductor_->answer(answer);
  }
}

std::string Server::obey(ControlServer::ClientId client, const std::string& order) {
  try {
    if (order.starts_with("fault ")) return obey_fault(order);
    if (order == "state") return "ok " + state();
    if (order.starts_with("hold ")) {
      const std::string moment = order.substr(5);
      Moment when = parse_moment(moment);
      when.run = run_clock_.present_or_next_run();
      timeline_.plan({client, moment}, when);
      return "ok";
    }
    if (order == "go") {
      if (held_ && held_->by == client) hold_or_answer(std::exchange(held_, {})->answer);
      return "ok";
    }
    return "error orders are: fault on NAME [VALUE], fault off NAME, hold WHEN, go, state";
  } catch (const InputError& error) {
    return fmt::format("error {}: {} {}", error.fault().place, error.fault().problem, error.fault().remedy);
  }
}

std::string Server::obey_fault(const std::string& order) {
  std::istringstream words(order);
  std::string fault, how, name, rest;
  words >> fault >> how >> name;
  const FaultKind& kind = fault_named(name);
  std::optional<double> value;
  if (double given = 0; words >> given) value = given;
  words.clear();
  if ((how != "on" && how != "off") || words >> rest || (how == "off" && value)) {
    return "error write fault on NAME [VALUE], or fault off NAME";
  }
  set(kind, how == "on" ? std::optional(kind.value(value)) : std::nullopt);
  return fmt::format("ok {} {} at {:.6f} s", name, how, static_cast<double>(rig_.now_ns()) * 1e-9);
}

std::string Server::state() const {
  nlohmann::json on = nlohmann::json::object();
  for (const auto& [name, value] : faults_on_)
    on[std::string(name)] = value;
  nlohmann::json document{{"now_s", static_cast<double>(rig_.now_ns()) * 1e-9}, {"faults", on}};
  const auto start_ns = run_clock_.run_start_ns();
  document["run_s"] = nullptr;
  if (start_ns)
    document["run_s"] = static_cast<double>(static_cast<int64_t>(rig_.now_ns() - *start_ns)) * 1e-9;
  return json_text(document);
}

}  // namespace diastole::sim_rig
