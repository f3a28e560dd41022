#include "host/cli/host_commands.hpp"

void diastole::add_host_commands(CommandLine& line) {
#define DIASTOLE_HOST_COMMAND(add) add(line);
#include "host/cli/command_list.inc"
#undef DIASTOLE_HOST_COMMAND
}
