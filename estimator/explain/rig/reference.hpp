#pragma once
// What sessions in which nothing is wrong show of their rig: its tolerances, and what its model misses by itself.
//
//   tolerances   their posterior of one session after the other, wider each time by what changes from day to day and from
//                casting to casting; they are simulated in these fits, since a hose's parts trade with each other along valleys
//   misfit       what all references leave of a segment's features in common is the rig's own: its best estimate is taken
//                off later sessions' features of the same segments, as far as it is known
//   shares       how large the model's error is in all (segments that no reference holds), and how much of it does not come
//                again: from how the references differ
//
// Of one reference how far it would come again is not seen: half of its misfit is taken to.

#include <Eigen/Dense>
#include <array>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "estimator/inference/termination.hpp"
#include "estimator/rig_fit/session_problem.hpp"

namespace diastole::explain {

struct ReferenceSegment {
  Eigen::VectorXd misfit;  ///< of the block's features, kPa or mL times root samples
  Eigen::VectorXd noise;   ///< its variance
};

struct Reference {
  std::vector<std::string> tolerances;  ///< names, in the order of the mean
  Eigen::VectorXd mean;                 ///< in sds of the list's priors
  Eigen::MatrixXd covariance;
  std::map<std::string, ReferenceSegment> segments;  ///< by rig::FeatureBlock::key
  rig::Shares all{};                                 ///< of the model's error without the references
  rig::Shares again{};                               ///< of the part that does not repeat
  std::array<double, rig::signal_count> rms{};       ///< of the references' misfit, kPa or mL
  std::array<double, rig::signal_count> percent_of_range{};
  double hose_length_m = 0.0, hose_bore_mm = 0.0;  ///< as the rig declares; 0: not kept
  size_t sessions = 0;
  /// Of the sessions' last fits and of the shares' that does not come again: that of the first which did not settle, or converged.
  inference::Termination termination = inference::Termination::converged;
  std::string fingerprint;  ///< of the recordings
};

/// Throws InputError if the hose that the study's rig declares is not that of the reference: it is another rig.
void require_rig_of(const Reference& reference, const rig::Session& session, const Study& study);

/// Fits the rig's model to each study's session. Throws InputError as read_session and SpecimenFamily do, and for studies of
/// different rigs.
Reference learn_reference(const std::vector<Study>& studies, size_t threads,
                          const std::function<void(std::string_view)>& progress = {});

/// Of the tolerances that only references teach, those of which this one says more than their list does: its part of the
/// information is the larger one.
std::vector<std::string_view> learnt_tolerances(const Reference& reference);

/// Priors, misfit and shares of a session of that rig.
void use_reference(const Reference& reference, rig::SessionProblem& problem);

}  // namespace diastole::explain
