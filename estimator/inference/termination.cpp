#include "estimator/inference/termination.hpp"

#include <array>

namespace diastole::inference {

bool is_settled(Termination termination) {
  return termination == Termination::converged || termination == Termination::on_bound;
}

Termination of_both(Termination first, Termination second) {
  return is_settled(first) && !is_settled(second) ? second : first;
}

std::string_view sentence(Termination termination) {
  constexpr std::array<std::string_view, 6> sentences{
      "Converged.",
      "Converged with an unknown on its bound; the cost falls beyond it.",
      "Failed: the cost has a slope, but no step lowers it.",
      "Stopped at the limit of iterations before it was at rest.",
      "Stopped on request; the cost was still falling.",
      "Failed: the model has no solution at the start."};
  return sentences[static_cast<size_t>(termination)];
}

}  // namespace diastole::inference
