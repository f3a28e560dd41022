#include "estimator/cli/commands.hpp"

namespace diastole {

void add_estimator_commands(CommandLine& line) { add_solve(line); }

}  // namespace diastole
