#pragma once
// `diastole catheter`: the paper's test of catheter and transducer, from a recorded step of pressure.

#include "protocol/contract/command.hpp"

namespace diastole {

void add_catheter(CommandLine& line);

}  // namespace diastole
