#include <gmock/gmock.h>

#include <optional>

#include "estimator/effects/effect.hpp"
#include "estimator/explain/rig/findings.hpp"
#include "estimator/explain/rig/held_out.hpp"
#include "estimator/explain/rig/search.hpp"
#include "estimator/explain/verdict/verdict.hpp"
#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole::explain {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

class SimulatedSession : public testing::Test {
 protected:
  SearchResult searched(const rig::SessionOptions& options, int iteration_limit = 40) {
    session_ = rig::simulated_session(family_, options);
    problem_.emplace(session_, family_, rig::RigFitOptions{.iteration_limit = iteration_limit});
    return search(session_, family_, *problem_, {});
  }
  rig::SpecimenFamily family_ = rig::gel_family();
  rig::Session session_;
  std::optional<rig::RigProblem> problem_;
};

TEST_F(SimulatedSession, WithoutAnEffectGetsNoName) {
  const SearchResult found = searched({.seed = 4});
  EXPECT_THAT(found.sets[found.best].ids(), IsEmpty());
  const Gap gap =
      held_out_gap(session_, *problem_, found.sets[found.best].fit, row_weights(session_, *problem_, {}));
  EXPECT_NE(judge(record_of(found), false, gap).verdict, Verdict::named);
}

TEST_F(SimulatedSession, WithALeakIsExplainedByItAndPredictsWhatWasNotFitted) {
  const Effect* leak = find_effect("cannula-leak-cavity");
  const SearchResult found = searched({.terms = {{leak, {}}}, .values = {0.15}, .seed = 5});
  const FittedSet& best = found.sets[found.best];
  EXPECT_THAT(best.ids(), ElementsAre("cannula-leak-cavity"));
  const Eigen::VectorXd weights = row_weights(session_, *problem_, {});
  const Gap gap = held_out_gap(session_, *problem_, best.fit, weights);
  EXPECT_GT(gap.before, 1.5);
  EXPECT_GT(gap.closed, 0.95);
  EXPECT_EQ(gap.held_out.size(), 3U);
  const FoundEffect effect = found_effects(best.fit, parameter_errors(best.fit, weights, 0.0)).at(0);
  EXPECT_LT(effect.parameters.at(0).ci90[0], 0.15);
  EXPECT_GT(effect.parameters.at(0).ci90[1], 0.15);
}

TEST_F(SimulatedSession, WithALeakIsNotNamedBySearchesThatWereCutShort) {
  const Effect* leak = find_effect("cannula-leak-cavity");
  const SearchResult found = searched({.terms = {{leak, {}}}, .values = {0.15}, .seed = 5}, 1);
  const rig::RigFit& best = found.sets[found.best].fit;
  const Gap gap = held_out_gap(session_, *problem_, best, row_weights(session_, *problem_, {}));
  const Judgement judgement = judge(record_of(found), false, gap);
  EXPECT_EQ(judgement.verdict, Verdict::unexplained);
  EXPECT_FALSE(is_settled(judgement.searches));
}

}  // namespace
}  // namespace diastole::explain
