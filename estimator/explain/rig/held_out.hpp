#pragma once
// How well a set of effects predicts waveforms that it was not fitted to.
//
// Each run in turn (of a single run: each segment) is predicted from the others, with the model's error that these others
// show. The logarithm of a waveform's density by one model over that by another is the first one's gain there.
//
// A set has to gain over a generic smooth discrepancy, too: of polynomials of volume and flow to the third power and of two
// harmonics of the cycle's phase, in each pressure, as many as the set has values, those that explain most of the other
// waveforms beside the model without effects. It knows no physics; what predicts no better than it does says where the misfit
// lies, and not what it is. Before the data it is as improbable as the set.
//
// A model that pulls parts of the rig far off predicts well once the other waveforms have paid for that. It is charged
// with how seldom parts are so far off (part_strain.hpp).

#include <string>
#include <vector>

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/explain/verdict/explanation.hpp"

namespace diastole::explain {

/// Features that are predicted from all others.
struct Fold {
  std::string name;
  std::vector<bool> held;

  [[nodiscard]] std::vector<Eigen::Index> others() const;
};
/// Of each run; of a single run of each segment.
std::vector<Fold> folds_of(const rig::SessionProblem& problem);

/// Reduced chi-squares on each fold by values that were fitted to all others, over noise and the model's error of `after`. The
/// floor is what `after` leaves if it is fitted to all, where that is less than its error: nothing predicts better.
Gap held_out_gap(const rig::SessionProblem& problem, const EffectSet& before, const EffectSet& after);

/// Features about a point: target = columns * u + error, u ~ N(0, 1).
struct LinearFeatures {
  Eigen::VectorXd target;
  Eigen::MatrixXd columns;
};
/// ln density of all features but `others`, given these.
double held_out_density(const LinearFeatures& features, const rig::ModelError& error,
                        const std::vector<Eigen::Index>& others, const rig::Shares& shares);

/// Features of the smooth functions, a column each.
Eigen::MatrixXd smooth_functions(const rig::SessionProblem& problem);
/// The model without effects beside as many of the functions: those that explain most of these rows.
LinearFeatures smooth_discrepancy(const EffectSet& plain, const Eigen::MatrixXd& functions, size_t count,
                                  const std::vector<Eigen::Index>& rows);

struct HeldOutGain {
  double log_pseudo_bayes_factor = 0.0;
  inference::Termination termination = inference::Termination::converged;  ///< of all folds' fits
};
/// What a set gains over the better of the models without its effects: ln of the pseudo-Bayes factor, the product over folds of
/// their predictive densities (S. Geisser, W. F. Eddy, J. Am. Stat. Assoc. 74 (1979) 153) times that of their parts.
HeldOutGain held_out_gain(const rig::SessionProblem& problem, const EffectSet& plain, const EffectSet& set);

/// ln of the mean of what e to these is.
double log_mean(const std::vector<double>& logarithms);

}  // namespace diastole::explain
