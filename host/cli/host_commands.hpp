#pragma once
// The commands of the host side, one file each (command_list.inc).

#include <memory>

#include "protocol/contract/command.hpp"

namespace diastole {

class SessionSeries;

#define DIASTOLE_HOST_COMMAND(add) void add(CommandLine& line);
#include "host/cli/command_list.inc"

void add_run(CommandLine& line, std::shared_ptr<SessionSeries> series);

/// All of them. `series`: what `run` can acquire besides one session.
inline void add_host_commands(CommandLine& line, const std::shared_ptr<SessionSeries>& series) {
#define DIASTOLE_HOST_COMMAND(add) add(line);
#include "host/cli/command_list.inc"
  add_run(line, series);
}

}  // namespace diastole
