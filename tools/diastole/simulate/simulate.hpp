#pragma once
// `diastole simulate`: a whole session without hardware, through the real daemon.

#include "protocol/contract/command.hpp"

namespace diastole {

void add_simulate(CommandLine& line);

}  // namespace diastole
