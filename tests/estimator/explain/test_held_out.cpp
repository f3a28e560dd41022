#include "estimator/explain/rig/held_out.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numeric>
#include <optional>

#include "estimator/explain/rig/part_strain.hpp"
#include "estimator/explain/rig/set_fit.hpp"
#include "estimator/explain/rig/value_errors.hpp"
#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

class HeldOut : public testing::Test {
 protected:
  void record(size_t runs) {
    session_ = rig::simulated_session(family_, {.seed = 31});
    session_.runs.resize(runs);
    problem_.emplace(session_, family_, 2);
    const rig::LinearisedModel base = rig::declared_rig(*problem_);
    plain_ = fit_set(*problem_, base.at, base, problem_->error().prior.share);
  }
  /// What is left of a target by its columns, over the noise and the model's error.
  [[nodiscard]] double left(const LinearFeatures& features) const {
    const rig::EvidenceFit fit =
        fit_linear(features.target, features.columns, problem_->error(), plain_.evidence.shares);
    return fit.left.cwiseAbs2().cwiseQuotient(fit.variance).sum();
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  rig::Session session_;
  std::optional<rig::SessionProblem> problem_;
  EffectSet plain_;
};

TEST_F(HeldOut, IsARunOrOfASingleRunASegment) {
  record(3);
  std::vector<Fold> folds = folds_of(*problem_);
  ASSERT_EQ(folds.size(), 3U);
  Index held = 0;
  for (const Fold& fold : folds)
    held += problem_->features().count() - static_cast<Index>(fold.others().size());
  EXPECT_EQ(held, problem_->features().count());
  record(1);
  folds = folds_of(*problem_);
  ASSERT_EQ(folds.size(), 1U);
  EXPECT_EQ(folds.front().name, "baseline.run.h5, segment 0");
}

TEST_F(HeldOut, SmoothDiscrepanciesAreThoseThatExplainMost) {
  record(3);
  const MatrixXd functions = smooth_functions(*problem_);
  ASSERT_TRUE(functions.allFinite());
  EXPECT_GT(functions.colwise().norm().minCoeff(), 0.0);
  const double before = left({plain_.target(), plain_.columns});
  // A bend by the square of the volume, at the cavity alone, and one by the flow's.
  plain_.evidence.left += 0.4 * functions.col(2) - 0.2 * functions.col(4);
  EXPECT_GT(left({plain_.target(), plain_.columns}), 4.0 * before);
  std::vector<Index> rows(static_cast<size_t>(functions.rows()));
  std::iota(rows.begin(), rows.end(), Index{0});
  EXPECT_NEAR(left(smooth_discrepancy(plain_, functions, 2, rows)), before, 0.1 * before);
  EXPECT_EQ(smooth_discrepancy(plain_, functions, 2, rows).columns.cols(), plain_.columns.cols() + 2);
}

TEST_F(HeldOut, NothingIsGainedByWhatChangesNothing) {
  record(3);
  EXPECT_NEAR(held_out_gain(*problem_, plain_, plain_).log_pseudo_bayes_factor, 0.0, 1e-6);
}

TEST_F(HeldOut, AFoldWhoseSearchDidNotSettleIsReported) {
  record(3);
  EXPECT_EQ(held_out_gain(*problem_, plain_, plain_).termination, inference::Termination::converged);
  EffectSet far = plain_;
  far.evidence.shares.fill(1e100);  // of the model's error: farther than a search for it goes
  EXPECT_EQ(held_out_gain(*problem_, far, plain_).termination, inference::Termination::iteration_limit);
}

TEST_F(HeldOut, PartsFarOffAreSeldom) {
  record(3);
  const auto parts =
      static_cast<double>(plain_.model.nuisances.size()) - static_cast<double>(rig::basic_nuisances);
  VectorXd u = VectorXd::Zero(plain_.model.nuisances.size());
  EXPECT_NEAR(strain_by_chance(*problem_, plain_.model, u), 1.0, 1e-12);
  u[u.size() - 1] = -5.0;
  const double beyond_five_sds = 5.733e-7;  // of a normal variable, to both sides
  EXPECT_NEAR(strain_by_chance(*problem_, plain_.model, u), parts * beyond_five_sds,
              1e-3 * parts * beyond_five_sds);
}

/// One value from twenty waveforms of fifty features, of which every other says half more and the rest half less.
TEST(ValueErrors, AreThoseOfWaveformsThatDisagree) {
  constexpr size_t waveforms = 20, each = 50;
  constexpr double apart = 0.5, all = waveforms * each;
  LinearFeatures features{Eigen::VectorXd(waveforms * each), MatrixXd::Ones(waveforms * each, 1)};
  std::vector<Fold> folds(waveforms);
  for (size_t k = 0; k < waveforms; ++k) {
    features.target.segment(static_cast<Index>(k * each), each)
        .setConstant(k % 2 == 0 ? 1 + apart : 1 - apart);
    folds[k].held.resize(waveforms * each, false);
    std::fill_n(folds[k].held.begin() + static_cast<std::ptrdiff_t>(k * each), each, true);
  }
  const VectorXd weight = VectorXd::Ones(features.target.size());
  const MatrixXd precision = MatrixXd::Constant(1, 1, all);
  // Of a mean of twenty numbers, over that of a thousand with variance one.
  const double mean_of_twenty = apart * std::sqrt(waveforms / (waveforms - 1.0)) / std::sqrt(waveforms);
  EXPECT_NEAR(error_factors(features, weight, precision, folds)[0], mean_of_twenty * std::sqrt(all), 1e-9);
  features.target.setOnes();
  EXPECT_EQ(error_factors(features, weight, precision, folds)[0], 1.0);
  EXPECT_EQ(error_factors(features, weight, precision, {folds[0], folds[1]})[0], 1.0);
}

TEST(LogMean, IsThatOfTheMeanOfLikelihoodRatios) {
  EXPECT_NEAR(log_mean({0.0, std::log(3.0)}), std::log(2.0), 1e-12);
  EXPECT_NEAR(log_mean({-2000.0, 2000.0}), 2000.0 - std::log(2.0), 1e-9);
}

}  // namespace
}  // namespace diastole::explain
