#include "estimator/fe/solve_report.hpp"

#include <fmt/format.h>

#include <array>

namespace diastole {

std::string_view describe(SolveReason reason) {
  constexpr std::array<std::string_view, 7> words{
      "converged",        "inverted element", "strain beyond the law's limits", "no convergence",
      "singular tangent", "limit point",      "load-step limit reached"};
  return words[static_cast<size_t>(reason)];
}

std::optional<bool> SolveReport::stable() const {
  if (singular) return false;
  if (!unstable_motions) return {};
  return *unstable_motions == 0;
}

std::string SolveReport::describe() const {
  if (converged()) {
    return fmt::format("converged at {:g} kPa in {} load steps and {} Newton iterations",
                       reached_pressure_kPa, load_steps, newton_iterations);
  }
  std::string text =
      fmt::format("{} after {:g} kPa was reached ({} load steps, {} Newton iterations)",
                  diastole::describe(reason), reached_pressure_kPa, load_steps, newton_iterations);
  if (inverted) {
    const Eigen::Vector3d& place = inverted->reference_mm;
    text += fmt::format(
        "; element {} turns inside out at xi = ({:.3f}, {:.3f}, {:.3f}), X = ({:.2f}, {:.2f}, {:.2f}) mm",
        inverted->point.element, inverted->point.xi[0], inverted->point.xi[1], inverted->point.xi[2],
        place[0], place[1], place[2]);
  }
  if (reason == SolveReason::singular_tangent && load_steps == 0)
    text +=
        "; the body can move without resistance: its supports or springs do not hold it in every direction";
  if (pressure_limit) {
    text += fmt::format(
        "; pressure {} near {:.4g} kPa, where the cavity's stiffness dP/dV is {:.1f} % of that at rest",
        pressure_limit->maximum ? "maximum" : "minimum", pressure_limit->pressure_kPa,
        100.0 * pressure_limit->left);
  }
  if (stable() == false) text += "; the last equilibrium is not stable";
  if (beyond_law) text += fmt::format("; the law has no stress at the strain of element {}", *beyond_law);
  if (!history.empty() && !history.back().iterations.empty()) {
    text += fmt::format("; the last attempt at {:g} kPa had corrections", history.back().pressure_kPa);
    for (const NewtonIteration& iteration : history.back().iterations)
      text += fmt::format(" {:.1e}", iteration.step);
  }
  return text;
}

}  // namespace diastole
