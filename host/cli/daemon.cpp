#include "host/daemon/daemon.hpp"

#include <memory>

#include "host/cli/host_commands.hpp"

namespace diastole {

void add_daemon(CommandLine& line) {
  auto options = std::make_shared<DaemonOptions>();
  options->producer = "diastole " DIASTOLE_VERSION;
  CLI::App* command =
      line.add("daemon", "run the acquisition daemon: it owns the controller, the instrument and the journal",
               "  diastole daemon --config rig.toml\n"
               "      serves until Ctrl-C or SIGTERM; prints one line of JSON when it is ready\n"
               "  diastole daemon --config rig.toml --port /dev/ttyUSB1\n"
               "      the same rig, with the controller at another port\n"
               "  diastole daemon --config rig.toml --console\n"
               "      with a page for the browser as well; `diastole console` prints its address");
  command->add_option("--config", options->config, "rig file")->required();
  command->add_option("--port", options->port, "controller's serial port, instead of the rig file's");
  command->add_option("--daq", options->daq_address, "instrument's HOST:PORT, instead of the rig file's");
  command->add_option("--socket", options->socket, "socket to serve at, instead of the rig file's");
  command->add_option("--journal-dir", options->journal_dir, "where journals go, instead of the rig file's");
  command
      ->add_option(
          "--console", options->console,
          "open a web console at [ADDRESS:]PORT; without one at 127.0.0.1:8600, for this machine only")
      ->expected(0, 1);
  command->add_option("--conductor", options->conductor,
                      "socket of a simulated rig that conducts time (diastole simulate uses it)");
  line.on_run(command, [options](const CommandOutput&) {
    run_daemon(*options);
    return ExitCode::done;
  });
}

}  // namespace diastole
