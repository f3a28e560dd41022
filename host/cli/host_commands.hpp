#pragma once
// The commands of the host side, one file each.

#include "protocol/contract/command.hpp"

namespace diastole {

void add_flash(CommandLine& line);
void add_calibrate(CommandLine& line);
void add_daemon(CommandLine& line);
void add_console(CommandLine& line);
void add_zero(CommandLine& line);
void add_run(CommandLine& line);
void add_status(CommandLine& line);
void add_continue(CommandLine& line);
void add_stop(CommandLine& line);
void add_home(CommandLine& line);
void add_jog(CommandLine& line);
void add_clear_fault(CommandLine& line);
void add_settings(CommandLine& line);
void add_black_box(CommandLine& line);
void add_inspect(CommandLine& line);
void add_bin(CommandLine& line);
void add_recover(CommandLine& line);
void add_export(CommandLine& line);

/// All of them, in the order in which a session uses them.
void add_host_commands(CommandLine& line);

}  // namespace diastole
