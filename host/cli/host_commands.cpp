#include "host/cli/host_commands.hpp"

namespace diastole {

void add_host_commands(CommandLine& line) {
  add_flash(line);
  add_daemon(line);
  add_console(line);
  add_zero(line);
  add_calibrate(line);
  add_home(line);
  add_run(line);
  add_continue(line);
  add_status(line);
  add_stop(line);
  add_jog(line);
  add_clear_fault(line);
  add_settings(line);
  add_black_box(line);
  add_inspect(line);
  add_bin(line);
  add_recover(line);
  add_export(line);
}

}  // namespace diastole
