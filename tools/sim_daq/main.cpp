// sim_daq: the simulated instrument on its own, in real time, with a sine on every channel.

#include <fmt/format.h>
#include <poll.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

#include "tools/program/program.hpp"
#include "tools/sim_daq/modbus_instrument.hpp"

namespace {

uint64_t monotonic_ns() {
  return static_cast<uint64_t>(std::chrono::steady_clock::now().time_since_epoch().count());
}

struct Options {
  diastole::sim_daq::InstrumentConfig instrument;
  double offset_V = 0;
  double amplitude_V = 1;
  double frequency_Hz = 1;
};

void serve(const Options& options) {
  const uint64_t start_ns = monotonic_ns();
  const auto now_ns = [start_ns] { return monotonic_ns() - start_ns; };
  diastole::sim_daq::ModbusInstrument instrument(
      options.instrument, {now_ns, [&](int) {
                             const double time_s = static_cast<double>(now_ns()) * 1e-9;
                             return options.offset_V +
                                    options.amplitude_V *
                                        std::sin(2 * std::numbers::pi * options.frequency_Hz * time_s);
                           }});
  fmt::print("{{\"modbus_host\": \"{}\", \"modbus_port\": {}}}\n", options.instrument.address,
             instrument.port());
  std::fflush(stdout);
  const int stop = diastole::stop_descriptor();
  std::vector<pollfd> waiting{{stop, POLLIN, 0}};
  while (waiting.front().revents == 0) {
    waiting.resize(1);
    for (const int fd : instrument.descriptors())
      waiting.push_back({fd, POLLIN, 0});
    ::poll(waiting.data(), waiting.size(), 200);
    instrument.service();
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "A simulated analog-input instrument: Modbus TCP with LabJack T-series registers\n"
      "(AIN#n as FLOAT32 at 2n, CORE_TIMER at 61520, TEST at 55100). Prints one JSON line with its address, "
      "serves until SIGTERM.",
      "sim_daq");
  app.footer("Example:\n  sim_daq --port 5020 --amplitude-V 2 --frequency-Hz 0.8 &");
  Options options;
  app.add_option("--port", options.instrument.port, "TCP port, 0 for any free one")->capture_default_str();
  app.add_option("--address", options.instrument.address, "address to listen on")->capture_default_str();
  app.add_option("--offset-V", options.offset_V, "mean of every channel")->capture_default_str();
  app.add_option("--amplitude-V", options.amplitude_V, "amplitude of the sine")->capture_default_str();
  app.add_option("--frequency-Hz", options.frequency_Hz, "frequency of the sine")->capture_default_str();
  app.add_option("--clock-error-ppm", options.instrument.clock_error_ppm, "error of the instrument's timer")
      ->capture_default_str();
  return diastole::run_program(app, argc, argv, [&] {
    serve(options);
    return diastole::ExitCode::done;
  });
}
