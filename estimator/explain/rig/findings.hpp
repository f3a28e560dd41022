#pragma once
// The parts of an Explanation that are read off fits: effects with intervals, places, shifts, traces.

#include <vector>

#include "estimator/explain/rig/residual_cells.hpp"
#include "estimator/explain/rig/search.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/explain/verdict/verdict.hpp"

namespace diastole::explain {

/// The fit's terms with values and 90 % intervals. Errors hold the model's own, see parameter_errors.
std::vector<FoundEffect> found_effects(const rig::RigFit& fit, const std::vector<double>& errors);

/// Standard errors in natural units of the fit's unknowns, with each square weighted: what noise and the model's
/// repeating error together leave open. `explained`: squares that the fit's effects take off; of a change so large the
/// model's error is no longer small beside the noise, and a part of it looks like a change of the parameters.
std::vector<double> parameter_errors(const rig::RigFit& fit, const Eigen::VectorXd& weights,
                                     double explained);

std::vector<ParameterShift> parameter_shifts(const rig::RigFit& before,
                                             const std::vector<double>& before_errors,
                                             const rig::RigFit& after,
                                             const std::vector<double>& after_errors);

/// Places where `before` misses, from its cells that stand out: one a channel and segment. Each goes to the port of
/// the effect of `after` that takes most of the misfit off there, or to the port that the channel suggests.
std::vector<Misfit> misfits(const rig::Session& session, const rig::RigProblem& problem,
                            const std::vector<ResidualCell>& cells,
                            const std::vector<const rig::RigFit*>& without, const rig::RigFit& after);

/// What the verdict asks of a search.
SearchRecord record_of(const SearchResult& search);

std::vector<Trace> traces(const rig::Session& session, const rig::RigProblem& problem,
                          const rig::RigFit& before, const rig::RigFit& after);

}  // namespace diastole::explain
