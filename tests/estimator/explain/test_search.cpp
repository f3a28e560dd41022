#include <gmock/gmock.h>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/findings.hpp"
#include "estimator/explain/held_out.hpp"
#include "estimator/explain/search.hpp"
#include "estimator/explain/verdict.hpp"
#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

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

class SimulatedSession : public testing::Test {
 protected:
  SearchResult searched(const rig::SessionOptions& options) {
    session_ = rig::simulated_session(family_, options);
    problem_.emplace(session_, family_);
    return search(session_, family_, *problem_, {});
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  rig::Session session_;
  std::optional<rig::RigProblem> problem_;
};

TEST_F(SimulatedSession, WithoutAnEffectGetsNoName) {
  const SearchResult found = searched({.seed = 4});
  EXPECT_THAT(found.sets[found.best].ids(), IsEmpty());
  EXPECT_NE(judge(found, {}).verdict, Verdict::named);
}

TEST_F(SimulatedSession, WithALeakIsExplainedByItAndPredictsWhatWasNotFitted) {
  const Effect* leak = find_effect("cannula-leak-cavity");
  const SearchResult found = searched({.ingredients = {{leak, {}}}, .values = {0.15}, .seed = 5});
  const FittedSet& best = found.sets[found.best];
  EXPECT_THAT(best.ids(), ElementsAre("cannula-leak-cavity"));
  const Eigen::VectorXd weights = row_weights(session_, *problem_);
  const Gap gap = held_out_gap(session_, *problem_, best.fit, weights);
  EXPECT_GT(gap.before, 2.0);
  EXPECT_GT(gap.closed, 0.95);
  EXPECT_EQ(gap.held_out.size(), 3U);
  const FoundEffect effect = found_effects(best.fit, parameter_errors(best.fit, weights)).at(0);
  EXPECT_LT(effect.parameters.at(0).ci90[0], 0.15);
  EXPECT_GT(effect.parameters.at(0).ci90[1], 0.15);
}

TEST(Verdicts, StructureThatIsLeftForbidsAName) {
  SearchResult search;
  search.sets.resize(2);
  search.sets[0].chi_square = 5000.0;
  search.sets[1].chi_square = 3000.0;
  search.sets[1].fit.ingredients = {{find_effect("hose-loss-excess"), {}}};
  search.best = 1;
  EXPECT_EQ(judge(search, {}).verdict, Verdict::named);
  ResidualCell cell;
  cell.p_value = 1e-30;
  EXPECT_EQ(judge(search, {cell}).verdict, Verdict::unexplained);
}

TEST(Verdicts, AsGoodASetOfTheSameSizeIsToldBesideIt) {
  SearchResult search;
  search.sets.resize(3);
  search.sets[0].chi_square = 5000.0;
  search.sets[1].chi_square = 3000.0;
  search.sets[2].chi_square = 3004.0;
  search.sets[1].fit.ingredients = {{find_effect("stroke-gain"), {}}};
  search.sets[2].fit.ingredients = {{find_effect("radius-error"), {}}};
  search.best = 1;
  const Judgement judgement = judge(search, {});
  EXPECT_EQ(judgement.verdict, Verdict::ambiguous);
  EXPECT_THAT(judgement.ambiguous_with, ElementsAre(ElementsAre("radius-error")));
}

TEST(Verdicts, WeakEvidenceIsNeitherANameNorNothing) {
  SearchResult search;
  search.sets.resize(1);
  search.leads = {{{find_effect("stroke-gain"), {}}, 20.0, 5.0, 1, {}},
                  {{find_effect("clock-skew"), {}}, 2.0, 5.0, 1, {}}};
  const Judgement judgement = judge(search, {});
  EXPECT_EQ(judgement.verdict, Verdict::ambiguous);
  EXPECT_THAT(judgement.ambiguous_with, ElementsAre(ElementsAre("stroke-gain")));
}

}  // namespace
}  // namespace diastole::explain
