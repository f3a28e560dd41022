#include "host/config/experiment_doubts.hpp"

#include <fmt/format.h>

namespace diastole {

std::vector<std::string> doubts_about(const Experiment& experiment) {
  constexpr double least_usual_stroke_mL = 1, mL_per_L = 1000;
  std::vector<std::string> doubts;
  for (size_t i = 0; i < experiment.segments.size(); ++i) {
    const double stroke_mL = experiment.segments[i].stroke_mL;
    if (stroke_mL <= 0 || stroke_mL >= least_usual_stroke_mL) continue;
    doubts.push_back(
        fmt::format("segment[{}].stroke_mL: a stroke of {:g} mL; {:g}? (It is in mL, not in litres.)", i,
                    stroke_mL, mL_per_L * stroke_mL));
  }
  return doubts;
}

}  // namespace diastole
