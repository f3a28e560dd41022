#include "estimator/inference/termination.hpp"

namespace diastole::inference {

bool is_settled(Termination termination) {
  return termination == Termination::converged || termination == Termination::on_bound;
}

std::string_view sentence(Termination termination) {
  switch (termination) {
    case Termination::converged:
      return "Converged.";
    case Termination::on_bound:
      return "Converged with an unknown on its bound; the cost falls beyond it.";
    case Termination::stalled:
      return "Failed: the cost has a slope, but no step lowers it.";
    case Termination::iteration_limit:
      return "Stopped at the limit of iterations; the cost was still falling.";
    case Termination::interrupted:
      return "Stopped on request; the cost was still falling.";
    case Termination::no_solution:
      return "Failed: the model has no solution at the start.";
  }
  return "";
}

}  // namespace diastole::inference
