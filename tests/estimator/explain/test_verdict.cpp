#include "estimator/explain/verdict/verdict.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

namespace diastole::explain {
namespace {

using inference::Termination;
using testing::ElementsAre;
using testing::HasSubstr;

Gap gap_of(double before, double after) {
  Gap gap;
  gap.before = before;
  gap.after = after;
  return gap;
}
const Gap better = gap_of(2.0, 1.0);

/// The base model leaves 5000, one effect 3000.
SearchRecord one_effect(const std::string& id) {
  return {.sets = {{{}, 5000.0, 0}, {{id}, 3000.0, 1}}, .best = 1, .screened = {}};
}

TEST(Verdicts, StructureThatIsLeftForbidsAName) {
  const SearchRecord search = one_effect("hose-loss-excess");
  EXPECT_EQ(judge(search, false, better).verdict, Verdict::named);
  EXPECT_EQ(judge(search, true, better).verdict, Verdict::unexplained);
}

TEST(Verdicts, WhatPredictsLeftOutRunsWorseThanNothingHasNoName) {
  const SearchRecord search = one_effect("temperature-drift");
  EXPECT_EQ(judge(search, false, gap_of(1.02, 1.10)).verdict, Verdict::unexplained);
  EXPECT_EQ(judge(search, false, gap_of(1.02, std::nan(""))).verdict, Verdict::unexplained);
}

TEST(Verdicts, SquaresThatAreNoNumbersNameNothing) {
  SearchRecord search = one_effect("hose-compliance");
  search.sets[0].chi_square = std::numeric_limits<double>::infinity();
  EXPECT_EQ(judge(search, false, better).verdict, Verdict::unexplained);
  search.best = 0;
  search.sets[0].chi_square = 3000.0;
  search.sets[1].chi_square = 3000.0;
  EXPECT_EQ(judge(search, false, better).verdict, Verdict::none);
  EXPECT_EQ(judge(search, false, gap_of(std::nan(""), std::nan(""))).verdict, Verdict::unexplained);
}

TEST(Verdicts, AsGoodASetOfTheSameSizeIsReportedBesideIt) {
  SearchRecord search = one_effect("stroke-gain");
  search.sets.push_back({{"radius-error"}, 3004.0, 1});
  const Judgement judgement = judge(search, false, better);
  EXPECT_EQ(judgement.verdict, Verdict::ambiguous);
  EXPECT_THAT(judgement.ambiguous_with, ElementsAre(ElementsAre("radius-error")));
}

TEST(Verdicts, WeakEvidenceIsNeitherANameNorNothing) {
  const SearchRecord search{
      .sets = {{}}, .best = 0, .screened = {{"stroke-gain", 20.0, 5.0, 1}, {"clock-skew", 2.0, 5.0, 1}}};
  const Judgement judgement = judge(search, false, better);
  EXPECT_EQ(judgement.verdict, Verdict::ambiguous);
  EXPECT_THAT(judgement.ambiguous_with, ElementsAre(ElementsAre("stroke-gain")));
}

TEST(Verdicts, ASearchThatDidNotSettleIsNeverNamed) {
  for (const Termination termination : {Termination::stalled, Termination::iteration_limit,
                                        Termination::interrupted, Termination::no_solution}) {
    for (const size_t unsettled : {0U, 1U}) {
      SearchRecord search = one_effect("stroke-gain");
      search.sets[unsettled].termination = termination;
      EXPECT_EQ(judge(search, false, better).verdict, Verdict::unexplained);
    }
  }
  SearchRecord search = one_effect("stroke-gain");
  search.sets[1].termination = Termination::on_bound;
  EXPECT_EQ(judge(search, false, better).verdict, Verdict::named);
}

TEST(Verdicts, TheSummarySaysWhichSearchDidNotSettle) {
  SearchRecord search = one_effect("stroke-gain");
  search.sets[1].termination = Termination::iteration_limit;
  const Judgement judgement = judge(search, false, better);
  ASSERT_EQ(judgement.searches.size(), 2U);
  EXPECT_FALSE(is_settled(judgement.searches));
  Explanation found;
  found.verdict = judgement.verdict;
  found.searches = judgement.searches;
  EXPECT_THAT(summary_of(found),
              HasSubstr("The search of stroke-gain did not converge: Stopped at the limit"));
  EXPECT_THAT(summary_of(found), HasSubstr("Nothing can be named."));
  EXPECT_THAT(evidence(search, judgement).front().verdict, HasSubstr("its search did not end"));
}

}  // namespace
}  // namespace diastole::explain
