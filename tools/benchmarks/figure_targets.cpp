#include "tools/benchmarks/figure_targets.hpp"

#include <fmt/format.h>

namespace diastole {

std::string FigureTargets::within(double value, double least, double most, const char* form) {
  return fmt::format(fmt::runtime(form), value) + mark(value >= least && value <= most);
}

std::string FigureTargets::mark(bool is_met) {
  ++figures_;
  missed_ += is_met ? 0 : 1;
  return is_met ? "" : " MISSED";
}

ExitCode FigureTargets::conclude() const {
  if (missed_ > 0) {
    fmt::print("\n{} of {} figures with a target MISSED it.\n", missed_, figures_);
    return ExitCode::negative;
  }
  if (figures_ > 0) fmt::print("\nAll {} figures with a target meet it.\n", figures_);
  return ExitCode::done;
}

}  // namespace diastole
