#pragma once
// The commands of the host side, one file each (command_list.inc).

#include "protocol/contract/command.hpp"

namespace diastole {

#define DIASTOLE_HOST_COMMAND(add) void add(CommandLine& line);
#include "host/cli/command_list.inc"

/// All of them, in the order in which a session uses them.
inline void add_host_commands(CommandLine& line) {
#define DIASTOLE_HOST_COMMAND(add) add(line);
#include "host/cli/command_list.inc"
}

}  // namespace diastole
