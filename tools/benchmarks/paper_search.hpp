#pragma once
// The paper's own search, for comparison: sequential quadratic programming (SLSQP of NLopt, Kraft 1994) on the sum of
// squared distances in mm (Eq. 6), every derivative a forward difference of new equilibria, parameters in their own
// units, ended when a step changes them by less than 0.001 of their norm. Frame pressures are taken as exact, neighbouring
// elements as unrelated, and no point as wild.

#include "estimator/fit/joint_problem.hpp"

namespace diastole {

inline constexpr double paper_tolerance = 0.001;

struct PaperFit {
  std::vector<double> values;
  inference::Termination termination = inference::Termination::no_solution;
  std::string reason;  ///< a sentence
  int iterations = 0;  ///< points at which a gradient was formed
  int forward_solves = 0;
};

/// `search`: its `interrupted` and its limit count, of evaluations of the cost. `on_step` is called at each gradient with half
/// the sum of squares, mm².
PaperFit fit_as_the_paper(MotionModel& model, const std::vector<EstimatedParameter>& parameters,
                          Measurement measurement, LocatorOptions locator,
                          const inference::SearchOptions& search = {});

}  // namespace diastole
