#include "estimator/explain/verdict/verdict.hpp"

#include <gmock/gmock.h>

namespace diastole::explain {
namespace {

using inference::Termination;
using testing::HasSubstr;

TEST(Verdicts, TheSummarySaysWhichSearchDidNotSettle) {
  Explanation found;
  found.verdict = Verdict::unexplained;
  found.searches = {{{}, Termination::converged}, {{"stroke-gain"}, Termination::iteration_limit}};
  EXPECT_FALSE(is_settled(found.searches));
  EXPECT_THAT(summary_of(found),
              HasSubstr("The search of stroke-gain did not converge: Stopped at the limit"));
  EXPECT_THAT(summary_of(found), HasSubstr("Nothing can be named."));
}

TEST(Verdicts, ASearchThatRestsOnABoundHasSettled) {
  EXPECT_TRUE(is_settled({{{}, Termination::converged}, {{"stroke-gain"}, Termination::on_bound}}));
  for (const Termination termination :
       {Termination::stalled, Termination::interrupted, Termination::no_solution})
    EXPECT_FALSE(is_settled({{{"stroke-gain"}, termination}}));
}

}  // namespace
}  // namespace diastole::explain
