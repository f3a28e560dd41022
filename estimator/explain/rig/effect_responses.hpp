#pragma once
// What each effect would do to a session's features, at several sizes: one simulation each, from which the evidence of
// all effects and pairs follows by linear algebra.
//
// An effect with several amplitudes (parts of relaxation, say) has a variant for each of them. Sizes are in the
// parameters' typical ones; between two whose changes differ in shape (cosine below 0.9) lies another, and where the line
// rings, so that shapes differ within some per cent of a size, further ones lie where the harmonics are as large as in
// the misfit, whatever their phases.

#include <array>
#include <vector>

#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// A model's effect of known values and how the features change by it.
struct Response {
  rig::ModelTerm term;
  std::vector<double> values;  ///< natural
  Eigen::VectorXd change;      ///< of the features
};

/// Of all effects that fit the specimen and have no change points, added to `base`. `scale`: sd of each feature.
std::vector<Response> effect_responses(const rig::SessionProblem& problem, const rig::LinearisedModel& base,
                                       const Eigen::VectorXd& scale);

/// Of the parameters' typical ones, that are simulated first.
inline constexpr std::array first_sizes{1.0, 4.0, 16.0};

/// An effect's values where the amplitudes that grow are as large and the others neutral, what is no amplitude typical; none if that
/// is beyond a bound.
std::vector<double> sized_values(const Effect& effect, const std::vector<double>& neutral,
                                 const std::vector<bool>& grows, double size);

/// Whether a parameter is a size: at its neutral value the effect does nothing, whatever the others.
bool is_amplitude(const Effect& effect, size_t parameter);

}  // namespace diastole::explain
