#include "estimator/cli/commands.hpp"

namespace diastole {

void add_estimator_commands(CommandLine& line, const ExplanationScorer& score) {
  add_solve(line);
  add_pressure_volume(line);
  add_reconstruct(line);
  add_fit(line);
  add_montecarlo(line);
  add_design(line);
  add_shear(line);
  add_report(line);
  add_mesh(line);
  add_effects(line);
  add_explain(line, score);
}

}  // namespace diastole
