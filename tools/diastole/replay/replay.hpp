#pragma once
// `diastole replay`: a recorded run once more, through simulated instrument, the real firmware and the real daemon.

#include "protocol/contract/command.hpp"

namespace diastole {

void add_replay(CommandLine& line);

}  // namespace diastole
