#pragma once
// What effects promise before any of them is fitted: by linear algebra over their responses, what each and each pair would take of
// a misfit beside the nuisances.

#include <Eigen/Core>
#include <vector>

#include "estimator/explain/rig/effect_responses.hpp"

namespace diastole::explain {

/// Responses that together promise a gain.
struct ScreenedSet {
  double gain = 0.0;  ///< of 2 ln likelihood
  std::vector<size_t> responses;
};

/// Products of what responses and misfit have beyond the nuisances, in sds.
class Screening {
 public:
  /// `columns`: of the nuisances. `responses` outlive it.
  Screening(const std::vector<Response>& responses, const Eigen::VectorXd& misfit,
            const Eigen::MatrixXd& columns, const rig::EvidenceFit& under);

  /// The gain of 2 ln likelihood by a response whose amplitude is free within bounds, or by two.
  [[nodiscard]] double single(size_t i) const;
  [[nodiscard]] double pair(size_t i, size_t j) const;

  struct Joined {
    double gain = 0.0;          ///< of 2 ln likelihood
    double log_evidence = 0.0;  ///< gained where each amplitude's prior is as wide as the amplitude
  };
  /// Responses together, of any amplitudes that are not negative.
  [[nodiscard]] Joined joined(std::vector<size_t> responses) const;

  /// All single effects (two variants of one among them), or all pairs; the best of each, the largest gain first.
  [[nodiscard]] std::vector<ScreenedSet> sets(bool pairs) const;
  /// Single effects but this one.
  [[nodiscard]] std::vector<ScreenedSet> singles_but(const Effect* effect) const;

 private:
  [[nodiscard]] double product(size_t i, size_t j) const {
    return products_(static_cast<Eigen::Index>(i) + 1, static_cast<Eigen::Index>(j) + 1);
  }
  [[nodiscard]] double along(size_t i) const { return products_(0, static_cast<Eigen::Index>(i) + 1); }
  [[nodiscard]] double square(size_t i) const { return product(i, i); }

  const std::vector<Response>& responses_;
  Eigen::MatrixXd products_;
};

/// Screened gains are right within their sizes' spacing: what promises half of the best, or is among the first, may turn out best.
bool is_worth_fitting(const std::vector<ScreenedSet>& sorted, size_t i, double least);

}  // namespace diastole::explain
