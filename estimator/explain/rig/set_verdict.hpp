#pragma once
// From sets of effects with their probabilities to a verdict: significant, material, settled.
//
// An effect is material if what it changes, modulus and offsets having followed, is larger than the model's own error in some
// channel (0.1 % of the range at least: no instrument is better), if parts of the declared rig would have to be two sds off to do the
// same (what is nearer is a tolerance), and if it is a tenth of the set's largest or its odds hold beside an error of a tenth in the others'
// equations (equation_errors.hpp). Immaterial ones are hints and
// named by nobody: probabilities of sets that differ by them add. A set is named with a probability of
// nine tenths; sets that are less certain are ambiguous. It has to have the same odds on waveforms that it was not fitted to
// alone, against the model without it and against a smooth discrepancy of like freedom (held_out.hpp). Where even the best set needs a model's error larger than what is
// known of it allows, the misfit is unexplained; so it is where new waveforms do not bear the set. It is "this set or nothing that is known" where they do not speak
// against it with such odds either, or where nothing is wrong with the rig without the set.
// That nothing is wrong is not said beside a tone that is as material (tone.hpp); a name stands beside it, since no effect
// makes one.

#include <optional>

#include "estimator/explain/rig/effect_sets.hpp"
#include "estimator/explain/verdict/explanation.hpp"
#include "estimator/rig_fit/cycle_scatter.hpp"
#include "estimator/rig_fit/tone.hpp"

namespace diastole::explain {

/// What is known of the model's error, and how much larger than it an effect has to be for a name.
struct ErrorKnowledge {
  bool from_reference = false;
  inference::Termination reference_termination = inference::Termination::converged;
  /// An error that is stated or estimated is known within a factor of two (SharePrior); what references left comes again within 1.5.
  [[nodiscard]] double least_size() const { return from_reference ? 1.5 : 2.0; }
};

/// The rules, in this order. A set stands for all that differ from it by hints alone: effects that are smaller than `least_size` times
/// the model's error, or than a tenth of the largest one and its equations' error, or that tolerances make as well.
///
///   unexplained  a part of the model's error, or of the rig, is as far off in 2.3 % by chance, or equal cycles differ as seldom as in
///                0.1 %, or a search that the verdict rests on did not settle: of the rig without effects, of the set (to all data and to
///                those of each fold), of the reference
///   ambiguous    the leading set has less than nine tenths, or the search of another one that has a twentieth or more did not settle: it would
///                have become likelier. The others are those with a twentieth or more
///   ambiguous    with nothing: its prediction of waveforms that were not fitted does not bear its prior odds, and does not exclude it
///                either, or the rig without it is as it should be
///   unexplained  the prediction excludes it, or a loud tone is left over
///   named, none  else
struct SetVerdict {
  Verdict verdict = Verdict::none;
  /// Of the sets that it names, or between which it is open. Of an unexplained one: that the leading set is wrong, from how seldom it
  /// shows by chance what speaks against it, or by the odds on waveforms that it was not fitted to; 0.5 where searches did not settle.
  double confidence = 0.0;
  size_t chosen = 0;                    ///< of the search's sets
  size_t plain = 0;                     ///< the one without effects in a rig with the chosen one's tolerances
  std::vector<double> size_over_error;  ///< of the chosen set's effects
  std::vector<bool> material;           ///< which of them count
  std::vector<std::vector<std::string>> ambiguous_with;
  std::vector<Hint> hints;
  std::vector<rig::CycleScatter> scatter = {};
  bool is_tone_alone = false;          ///< nothing else is unexplained
  std::optional<rig::Tone> tone = {};  ///< if it is louder than the noise and material as an effect has to be
  std::vector<SearchEnd> searches;
  /// Of the leading set, if it has more than the given effects: held_out_gain()'s.
  std::optional<double> log_pseudo_bayes_factor = {};
};

/// A change of the features beside a set: modulus and offsets follow.
struct ChangeSize {
  Eigen::VectorXd squares;    ///< of what they leave
  double over_error = 0.0;    ///< RMS over the model's error, the largest of the channels
  bool is_tolerance = false;  ///< parts of the declared rig, two sds off in all, make the same
};
ChangeSize size_of_change(const rig::SessionProblem& problem, const EffectSet& set,
                          const Eigen::VectorXd& change);

SetVerdict judge_sets(const rig::SessionProblem& problem, const WeighedSets& search,
                      const ErrorKnowledge& error);

/// RMS of the model's error in a channel, kPa or mL, at these shares; 0 where there is none.
double error_rms(const rig::SessionProblem& problem, const rig::Shares& shares, rig::Signal signal);

}  // namespace diastole::explain
