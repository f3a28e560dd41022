#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/rig/search.hpp"
#include "estimator/explain/verdict/verdict.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;

Gap gap_of(double before, double after) {
  Gap gap;
  gap.before = before;
  gap.after = after;
  return gap;
}
const Gap better = gap_of(2.0, 1.0);

TEST(Screening, GainIsWhatAFitOverBothTakesOffBeyondTheKnown) {
  Eigen::MatrixXd known(4, 1);
  known << 1, 1, 0, 0;
  Eigen::MatrixXd column(4, 1);
  column << 1, 0, 1, 0;
  const Eigen::Vector4d residuals(3, 1, 2, 5);
  // Beyond (1,1,0,0) the column is (1/2, -1/2, 1, 0): its part of the residuals is 3 / sqrt(3/2).
  EXPECT_NEAR(linear_gain(basis_of(known), column, residuals), 6.0, 1e-12);
  EXPECT_NEAR(linear_gain(basis_of(known), known, residuals), 0.0, 1e-12);
}

TEST(Screening, DependentColumnsAreLeftOut) {
  Eigen::MatrixXd columns = Eigen::MatrixXd::Random(20, 3);
  columns.col(2) = columns.col(0) - 2.0 * columns.col(1);
  EXPECT_EQ(basis_of(columns).cols(), 2);
}

TEST(Search, FollowsTheBestSetHoweverLowItLies) {
  EXPECT_TRUE(worth_following(0.9, 0.9));
  EXPECT_TRUE(worth_following(1.4, 1.4));
  EXPECT_TRUE(worth_following(1.3, 1.1));
  EXPECT_FALSE(worth_following(1.5, 1.1));
  EXPECT_FALSE(worth_following(1.02, 0.99));
}

TEST(Search, GivesUpWhereTheBestLeavesMostOfAPlainMisfit) {
  const auto set = [](double chi_square) {
    FittedSet made;
    made.fit.count = 1000;
    made.fit.chi_square = made.chi_square = chi_square;
    return made;
  };
  EXPECT_TRUE(leaves_misfit(set(5000.0), set(2000.0)));
  EXPECT_FALSE(leaves_misfit(set(5000.0), set(1200.0)));   // close to the noise
  EXPECT_FALSE(leaves_misfit(set(50000.0), set(2000.0)));  // most of it is found
}

TEST(Verdicts, StructureThatIsLeftForbidsAName) {
  SearchResult search;
  search.sets.resize(2);
  search.sets[0].chi_square = 5000.0;
  search.sets[1].chi_square = 3000.0;
  search.sets[1].fit.terms = {{find_effect("hose-loss-excess"), {}}};
  search.best = 1;
  EXPECT_EQ(judge(search, {}, better).verdict, Verdict::named);
  ResidualCell cell;
  cell.p_value = 1e-30;
  EXPECT_EQ(judge(search, {cell}, better).verdict, Verdict::unexplained);
}

TEST(Verdicts, WhatPredictsLeftOutRunsWorseThanNothingHasNoName) {
  SearchResult search;
  search.sets.resize(2);
  search.sets[0].chi_square = 5000.0;
  search.sets[1].chi_square = 3000.0;
  search.sets[1].fit.terms = {{find_effect("temperature-drift"), {}}};
  search.best = 1;
  EXPECT_EQ(judge(search, {}, gap_of(1.02, 1.10)).verdict, Verdict::unexplained);
  EXPECT_EQ(judge(search, {}, gap_of(1.02, std::nan(""))).verdict, Verdict::unexplained);
}

TEST(Verdicts, SquaresThatAreNoNumbersNameNothing) {
  SearchResult search;
  search.sets.resize(2);
  search.sets[0].chi_square = std::numeric_limits<double>::infinity();
  search.sets[1].chi_square = 3000.0;
  search.sets[1].fit.terms = {{find_effect("hose-compliance"), {}}};
  search.best = 1;
  EXPECT_EQ(judge(search, {}, better).verdict, Verdict::unexplained);
  search.best = 0;
  search.sets[0].chi_square = 3000.0;
  EXPECT_EQ(judge(search, {}, better).verdict, Verdict::none);
  EXPECT_EQ(judge(search, {}, gap_of(std::nan(""), std::nan(""))).verdict, Verdict::unexplained);
}

TEST(Verdicts, AsGoodASetOfTheSameSizeIsToldBesideIt) {
  SearchResult search;
  search.sets.resize(3);
  search.sets[0].chi_square = 5000.0;
  search.sets[1].chi_square = 3000.0;
  search.sets[2].chi_square = 3004.0;
  search.sets[1].fit.terms = {{find_effect("stroke-gain"), {}}};
  search.sets[2].fit.terms = {{find_effect("radius-error"), {}}};
  search.best = 1;
  const Judgement judgement = judge(search, {}, better);
  EXPECT_EQ(judgement.verdict, Verdict::ambiguous);
  EXPECT_THAT(judgement.ambiguous_with, ElementsAre(ElementsAre("radius-error")));
}

TEST(Verdicts, WeakEvidenceIsNeitherANameNorNothing) {
  SearchResult search;
  search.sets.resize(1);
  search.leads = {{{find_effect("stroke-gain"), {}}, 20.0, 5.0, 1, {}},
                  {{find_effect("clock-skew"), {}}, 2.0, 5.0, 1, {}}};
  const Judgement judgement = judge(search, {}, better);
  EXPECT_EQ(judgement.verdict, Verdict::ambiguous);
  EXPECT_THAT(judgement.ambiguous_with, ElementsAre(ElementsAre("stroke-gain")));
}

}  // namespace
}  // namespace diastole::explain
