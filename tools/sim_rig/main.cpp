// sim_rig: the whole rig without hardware. See --help.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <optional>

#include "protocol/contract/command.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/program/program.hpp"
#include "tools/sim_board/emulated_controller.hpp"
#include "tools/sim_rig/control_client.hpp"
#include "tools/sim_rig/fault_schedule.hpp"
#include "tools/sim_rig/faults.hpp"
#include "tools/sim_rig/hidden_effects.hpp"
#include "tools/sim_rig/host_built_controller.hpp"
#include "tools/sim_rig/imperfections.hpp"
#include "tools/sim_rig/rig_description.hpp"
#include "tools/sim_rig/server.hpp"

namespace {

namespace sim_rig = diastole::sim_rig;
using diastole::sim_controller::SimulatedController;

constexpr const char* purpose =
    R"(The whole rig without hardware: the pump's controller behind a pseudo-terminal, a pressure instrument behind
Modbus TCP (LabJack T-series registers), and the physics between them: piston, hose, gel phantom, catheter.

It prints one JSON line with its addresses when it is ready, and runs until SIGTERM. `diastole simulate` starts it for
you; start it yourself to work with the daemon as with a real rig:

  sim_rig --link /tmp/pump --modbus-port 5020 &
  diastole daemon --config rig.toml &         # with port = "/tmp/pump", host = "127.0.0.1", port = 5020
  diastole run examples/gel.experiment.toml -o gel.run.h5
)";

constexpr const char* footer =
    R"(Time follows the wall clock, or, with --conductor, the daemon that is started with the same --conductor:
then a session takes as long as the machine needs and is the same every time.

Faults are switched by name, at a given time or by hand while it runs; `sim_rig faults` lists them:
  sim_rig --fault leak@12.5s:off@20s --fault estop@run+3.2     ttl+T: after the first trigger; run+T: the start of run
  sim_rig --fault daq-drop@ttl+5+0.2 --fault sensor-offset@9/1.5              +LENGTH, and /VALUE where it takes one
  sim_rig --control /tmp/rig --link /tmp/pump --modbus-port 5020 &
  sim_rig ctl --at /tmp/rig fault on air-bubble 50
  sim_rig ctl --at /tmp/rig fault off air-bubble

Effects can be hidden in the rig, to try `diastole explain` on; `sim_rig hidden` lists them. How large they are, the
seed draws, and only the sealed file tells:
  sim_rig --hide air-bubble-pump --hide sensor-drift --hide-seed 7 --sealed mine.sealed.json

With --play the instrument shows a recorded run's pressure, sample by sample; `diastole replay` uses it.)";

struct Arguments {
  std::string config;
  std::string image;
  uint64_t seed = 1;
  uint64_t rig_seed = 0;
  bool real_time = false;
  std::vector<std::string> faults;
  std::vector<std::string> hidden;
  std::optional<uint64_t> hide_seed;
  std::string sealed;
  sim_rig::ServerOptions server;
  std::string control;             ///< of the rig to which `ctl` speaks
  std::vector<std::string> order;  ///< its words
};

void add_options(CLI::App& app, Arguments& arguments) {
  app.add_option("--config", arguments.config, "rig.toml: geometry, channels, and the table [simulation]");
  app.add_option("--image", arguments.image,
                 "run this image of the firmware (.elf or .bin) on the emulated board, not the host build");
  app.add_option("--link", arguments.server.link, "make this a symbolic link to the pseudo-terminal");
  app.add_option("--modbus-port", arguments.server.modbus_port,
                 "TCP port of the instrument, 0 for any free one")
      ->capture_default_str();
  auto* conductor = app.add_option("--conductor", arguments.server.conductor,
                                   "let the daemon conduct time through this socket");
  app.add_flag("--real-time", arguments.real_time, "follow the wall clock (the default without --conductor)")
      ->excludes(conductor);
  app.add_option("--pins", arguments.server.pins, "write every change of a pin: time_ns,signal,value");
  app.add_option("--volume", arguments.server.volume,
                 "write the cavity's true volume between triggers: trigger,since_s,cavity_mL");
  app.add_option("--control", arguments.server.control, "take orders (sim_rig ctl) at this socket");
  app.add_option("--play", arguments.server.play, "let the instrument show this recorded run's pressure");
  app.add_option("--host-drift-ppm", arguments.server.host_drift_ppm,
                 "with --conductor: let the daemon's clock run this much fast")
      ->check(diastole::number_between(-1000.0, 1000.0));
  app.add_option("--seed", arguments.seed, "of the sensors' noise")->capture_default_str();
  app.add_option("--rig-seed", arguments.rig_seed,
                 "draw a rig whose parts are off by what such parts are off by; 0: as the rig file has it")
      ->capture_default_str();
  app.add_option("--fault", arguments.faults, "make something go wrong, NAME@T; may be repeated");
  app.add_option("--hide", arguments.hidden,
                 "an effect (sim_rig hidden), none, outside or any; may be repeated");
  app.add_option("--hide-seed", arguments.hide_seed,
                 "of the hidden effects' sizes, if not that of the noise");
  app.add_option("--sealed", arguments.sealed, "write what is hidden to this file");
}

void add_commands(CLI::App& app, Arguments& arguments) {
  app.add_subcommand("faults", "list the faults: name, usual value, what each looks like");
  app.add_subcommand("hidden", "list the effects that can be hidden: id and port");
  CLI::App* ctl = app.add_subcommand("ctl", "give a running rig an order");
  ctl->add_option("--at", arguments.control, "its --control socket")->required();
  ctl->add_option("ORDER", arguments.order, "fault on NAME [VALUE] | fault off NAME | state")->required();
  ctl->footer(
      "Examples:\n  sim_rig ctl --at /tmp/rig fault on leak 3\n  sim_rig ctl --at /tmp/rig fault off leak");
}

std::unique_ptr<SimulatedController> make_controller(const std::string& image) {
  if (image.empty()) return sim_rig::make_host_built_controller();
  return std::make_unique<diastole::EmulatedController>(std::vector{diastole::read_image(image)});
}

void hide(const Arguments& arguments, sim_rig::PlantConfig& plant) {
  const std::string truth =
      sim_rig::hide(arguments.hidden, arguments.hide_seed.value_or(arguments.seed), plant);
  if (arguments.sealed.empty()) return;
  std::ofstream file(arguments.sealed, std::ios::binary);
  file << truth;
  if (!file.flush())
    throw diastole::InputError(
        {arguments.sealed, "", "cannot be written", "Name a file in a folder that exists for --sealed."});
}

void serve(Arguments arguments) {
  using diastole::TableReader;
  auto description = sim_rig::read_rig_description(
      arguments.config.empty() ? TableReader::from_text(sim_rig::default_rig_toml(), "the built-in rig file")
                               : TableReader::from_file(arguments.config));
  description.plant.seed = arguments.seed;
  sim_rig::draw_imperfections(arguments.rig_seed, description.plant);
  hide(arguments, description.plant);
  arguments.server.faults = sim_rig::parse_faults(arguments.faults);
  const int stop = diastole::stop_descriptor();
  sim_rig::Server server(description, make_controller(arguments.image), arguments.server);
  fmt::print("{}\n", server.addresses());
  std::fflush(stdout);
  server.run(stop);
}

void carry_out(const CLI::App& app, const Arguments& arguments) {
  if (app.got_subcommand("faults")) {
    fmt::print("{}", sim_rig::list_of_faults());
  } else if (app.got_subcommand("hidden")) {
    fmt::print("{}", sim_rig::list_of_hidden());
  } else if (app.got_subcommand("ctl")) {
    fmt::print(
        "{}\n",
        sim_rig::ControlClient(arguments.control).order(fmt::format("{}", fmt::join(arguments.order, " "))));
  } else {
    serve(arguments);
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(purpose, "sim_rig");
  app.footer(footer);
  Arguments arguments;
  add_options(app, arguments);
  add_commands(app, arguments);
  return diastole::run_program(app, argc, argv, [&] {
    carry_out(app, arguments);
    return diastole::ExitCode::done;
  });
}
