#pragma once
// How wrong the rig's model is by itself, as a zero-mean process over a session's features, and the fit under it.
//
// The error of a feature is independent and normal with variance share^2 * size^2: `size` is the part of the segment's
// range that may lie in it (near the harmonics that the segment has, and falling as 1/(1+k)^1.5 elsewhere), summing to
// the range itself over a segment, and `share` is one number for each group of features: what repeats and what sets in
// or drifts, of each channel. A share is itself unknown: its logarithm is normal about what is stated or was learnt on
// references, and its estimate is where evidence is largest. With the noise D and the columns K of unknowns u ~ N(0, 1)
//
//   z = K u + e,   e ~ N(0, D + share^2 size^2),   ln evidence = ln N(z; 0, D + share^2 size^2 + K K') + ln prior(share).

#include <Eigen/Dense>
#include <array>
#include <string_view>

#include "estimator/inference/termination.hpp"
#include "estimator/rig_fit/segment_features.hpp"

namespace diastole::rig {

enum class ErrorGroup : size_t { cavity, cavity_transient, pump, pump_transient, volume };
inline constexpr size_t error_groups = 5;
std::string_view name_of(ErrorGroup group);  ///< "cavity_transient"
using Shares = std::array<double, error_groups>;

struct SharePrior {
  Shares share{0.005, 0.003, 0.04, 0.02, 0.005};  ///< of the range
  /// Sd of the logarithm where the share is larger than that: a factor of two; at the pump, where most of the error is
  /// ringing that depends on every part's tolerance, of three.
  Shares up{0.7, 0.7, 1.1, 1.1, 0.7};
  Shares down{1.6, 1.6, 1.6, 1.6, 1.6};  ///< and where it is smaller: some rigs are far better than most
  /// None is better: 0.1 % is the class of the best transducers.
  static constexpr Shares least{0.001, 0.0006, 0.001, 0.0006, 0.001};
};

/// Variances by feature.
struct ModelError {
  Eigen::VectorXd noise;
  Eigen::VectorXd unit;  ///< of the model's error at a share of one
  std::vector<ErrorGroup> group;
  SharePrior prior;
  std::array<double, signal_count> range{};  ///< of the session in each signal

  [[nodiscard]] Eigen::VectorXd variance(const Shares& shares) const;
};
ModelError model_error_of(const SegmentFeatures& features);

/// A fit of linear unknowns whose priors are N(0, 1).
struct EvidenceFit {
  Eigen::VectorXd estimate;   ///< the most probable u
  Eigen::MatrixXd precision;  ///< of u
  Eigen::VectorXd left;       ///< z - K u
  Eigen::VectorXd variance;   ///< D + share^2 size^2
  Shares shares{};
  double log_evidence = 0.0;
  double chi_square = 0.0;  ///< left' left / variance + u'u
  /// Of the shares' search; converged where they were given.
  inference::Termination termination = inference::Termination::converged;

  /// By how many of its prior's sds the logarithm of a group's share is larger than expected.
  [[nodiscard]] Shares surprise(const SharePrior& prior) const;
};
/// With the shares that make the evidence largest, from `start`: until a step promises less than a hundredth of a nat.
EvidenceFit fit_with_shares(const Eigen::VectorXd& z, const Eigen::MatrixXd& columns, const ModelError& error,
                            const Shares& start);
/// With given shares.
EvidenceFit fit_linear(const Eigen::VectorXd& z, const Eigen::MatrixXd& columns, const ModelError& error,
                       const Shares& shares);

}  // namespace diastole::rig
