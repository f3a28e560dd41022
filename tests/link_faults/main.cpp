// link_faults: a bad serial line, on purpose. See --help.

#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "protocol/contract/command.hpp"
#include "tests/link_faults/proxy.hpp"
#include "tools/program/program.hpp"

namespace {

constexpr const char* purpose =
    R"(Puts a bad line between the controller and its host: opens the controller's serial port, offers a pseudo-terminal
to the host, and damages what passes, with a seed that makes it repeatable.

  sim_board build/firmware/bin/diastole-stm32f405.elf --link /tmp/pump --real-time
  link_faults --port /tmp/pump --link /tmp/bad-pump --bit-error 1e-4 --repeat 0.01 --reorder 0.01

and `port = "/tmp/bad-pump"` in the rig file. Ends on Ctrl-C, or after --seconds, with a table of what it did.)";

constexpr const char* footer =
    R"(The line is cut into frames at the 0x00 that ends each. Rates are probabilities from 0 to 1.
Exit codes: 0 done, 2 wrong usage or input, 3 a port is missing, busy or gone.)";

void add_options(CLI::App& app, diastole::link_faults::ProxyOptions& options,
                 diastole::link_faults::FaultRates& rates, std::string& direction) {
  app.add_option("--port", options.port, "the controller's serial port, or the link of sim_board or sim_rig")
      ->required();
  app.add_option("--link", options.link, "symbolic link to the pseudo-terminal for the host")->required();
  app.add_option("--baud", options.baud, "of the controller's port")->capture_default_str();
  app.add_option("--seed", options.seed, "equal seeds and traffic give equal faults")->capture_default_str();
  const auto rate = [&app](const char* name, double& value, const char* what) {
    app.add_option(name, value, what)->check(diastole::number_between(0.0, 1.0))->capture_default_str();
  };
  rate("--bit-error", rates.bit_error, "of each bit: is flipped");
  rate("--byte-loss", rates.byte_loss, "of each byte: is missing");
  rate("--frame-loss", rates.frame_loss, "of each frame: is missing");
  rate("--repeat", rates.repetition, "of each frame: comes twice");
  rate("--reorder", rates.reordering, "of each frame: is overtaken by the next one to three");
  rate("--truncate", rates.truncation, "of each frame: some of its end is missing");
  app.add_option("--delay-us", rates.delay_us, "of every frame")->capture_default_str();
  app.add_option("--jitter-us", rates.jitter_us, "at most so much more, in order")->capture_default_str();
  app.add_option("--direction", direction, "which way is bad: both, to-controller, to-host")
      ->check(CLI::IsMember({"both", "to-controller", "to-host"}))
      ->capture_default_str();
  app.add_option("--seconds", options.seconds, "end after this time (default: run until Ctrl-C)")
      ->check(diastole::positive_number);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(purpose, "link_faults");
  app.footer(footer);
  diastole::link_faults::ProxyOptions options;
  diastole::link_faults::FaultRates rates;
  std::string direction = "both";
  add_options(app, options, rates, direction);
  return diastole::run_program(app, argc, argv, [&] {
    if (direction != "to-host") options.to_controller = rates;
    if (direction != "to-controller") options.to_host = rates;
    fmt::print("{}", to_text(diastole::link_faults::run_proxy(options, diastole::stop_descriptor())));
    return diastole::ExitCode::done;
  });
}
