#pragma once
// Which experiment to run next, from a lattice of what the rig can do (estimator/explain/verdict/experiment_plan.hpp) and what each would show
// (experiment_outlook.hpp): up to three segments in one file, with the equipment that the session had; with a
// transducer at the pump end, gated volumes, an image at rest or a shear test in addition only where nothing else
// separates.

#include <optional>
#include <vector>

#include "estimator/explain/rig/experiment_outlook.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

struct ExperimentDesign {
  const rig::SessionProblem& problem;
  ExperimentLimits limits;
  size_t threads = 2;
  SpecimenKnowledge knowledge = {};
};

/// For an ambiguous verdict: what separates the fitted models best, judged by its least distinguishable pair, whichever of
/// the two is true. Of more than three the first three are judged. Nothing for fewer than two, or if the limits allow
/// no segment.
std::optional<NextExperiment> separating_experiment(const ExperimentDesign& design,
                                                    const std::vector<const FittedModel*>& competing);

/// For a named one: what narrows the interval of its least known parameter most. predicted_separation_sigma: that parameter's
/// distance from its neutral value afterwards.
std::optional<NextExperiment> sharpening_experiment(const ExperimentDesign& design, const FittedModel& named);

/// For an unexplained one: the segment at which the misfit is worst, again and longer, and once more at half the rate: what
/// depends on time and what on phase then part. Nothing if the misfit is in no segment of a run.
std::optional<NextExperiment> exposing_experiment(const ExperimentDesign& design, const Misfit& worst);

}  // namespace diastole::explain
