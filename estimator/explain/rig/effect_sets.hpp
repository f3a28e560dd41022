#pragma once
// Which sets of effects a session's features speak for: every single effect and every pair by linear algebra over the
// effects' responses, those that promise most by fits, each fit with the evidence of its set.
//
// The evidence of a set is the marginal likelihood of the features (model_error.hpp) over modulus, offsets, tolerances
// and the effects' values, by Laplace's approximation about the fit. A size's logarithm is uniform over two decades
// (ln 100 = 4.6; of both signs, over twice that), other parameters are uniform within their bounds; an effect is there
// in one session of forty, and as many change points are possible as there are cycles.
//
// Words of these files:
//   u          the nuisances (modulus, offsets, tolerances) in sds of what is known of them beforehand
//   shares     how large the model's error is, one number for each group of features (model_error.hpp)
//   given      effects that the study's model has already: they are in every set
//   plain      the set without effects but the given ones
//   described  how far parts may be off by the list of tolerances or the rig's file; finer: all of them so many times less
//   in reach   less far behind the best set than fits bring that go on from linear tolerances: 50 nats; near: the plain set,
//              where it is in reach of the best single effect as fitted; behind: a set of a finer rig, out of reach of what the described one has
//   strained   of a set that needs a part of the rig further off than is seldom by chance (part_strain.hpp)

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "estimator/explain/rig/effect_responses.hpp"
#include "estimator/inference/termination.hpp"
#include "estimator/rig_fit/base_fit.hpp"

namespace diastole::explain {

/// That a given effect is there, in a session that somebody asks about.
inline constexpr double effect_odds = 1.0 / 40.0;
/// Of 2 ln likelihood by an effect, below which its prior odds alone speak against it.
inline const double least_gain = 2.0 * std::log(1.0 / effect_odds);
/// What a real part does differs from an effect's equations by such a share at the most: as one sd where a misfit beside the effect is
/// judged, as two in its values' intervals (value_errors.hpp).
inline constexpr double right_to = 0.1;

struct EffectSet {
  rig::SessionModel model;             ///< as fitted
  std::vector<rig::Unknown> unknowns;  ///< of the effects
  std::vector<double> errors;          ///< of the effects' values, natural
  Eigen::MatrixXd covariance;          ///< of the effects' values' coordinates, the moments and nuisances
  rig::EvidenceFit evidence;
  rig::LinearisedModel
      known;                ///< that model, what it shows, and the nuisances' columns as they were last taken
  Eigen::MatrixXd columns;  ///< of the evidence's linear unknowns: the effects', then the nuisances
  double log_posterior = 0.0;  ///< evidence and prior
  bool exact = false;          ///< its tolerances were simulated
  bool by_part = false;        ///< what a part gained by being fitted exactly is in its posterior alone
  inference::Termination termination = inference::Termination::no_solution;

  [[nodiscard]] std::vector<std::string> ids() const;  ///< sorted
  /// What the evidence's linear unknowns are to explain.
  [[nodiscard]] Eigen::VectorXd target() const { return evidence.left + columns * evidence.estimate; }
  /// The evidence's precision without the priors of the effects' values, which are no measurement of them.
  [[nodiscard]] Eigen::MatrixXd precision_by_data() const {
    constexpr double nearly_nothing = 1e-6;
    Eigen::MatrixXd precision = evidence.precision;
    precision.diagonal().head(columns.cols() - model.nuisances.size()).array() -= 1.0 - nearly_nothing;
    return precision;
  }
};

struct WeighedSets {
  std::vector<EffectSet> sets;  ///< the most probable first; one of them has no effects
  std::vector<double> probability;
  std::vector<std::pair<std::string, double>> single_gains;  ///< of single effects: the gain of 2 ln evidence
  size_t given = 0;                                          ///< effects that every set has
};

struct SetSearchOptions {
  std::vector<rig::ModelTerm> terms = {};  ///< that every set has
  std::vector<double> values = {};         ///< of them, to start from
  std::function<void(std::string_view)> progress = {};
};

WeighedSets search_sets(const rig::SessionProblem& problem, const SetSearchOptions& options = {});

}  // namespace diastole::explain
