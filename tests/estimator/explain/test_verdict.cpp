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

TEST(Verdicts, ALearnedLawIsNamedWithThoseThatPredictAsWell) {
  Explanation found;
  found.verdict = Verdict::unexplained;
  LearnedTerm& term = found.learned.emplace();
  term.port = "drive";
  term.sets = "V_piston";
  term.variables = {"V_command"};
  term.rivals = {{"specimen", "p", {"V"}, {}, {}}};
  EXPECT_THAT(summary_of(found),
              HasSubstr("learnt at the port drive, V_piston by V_command, or as well at the "
                        "port specimen, p by V, closes"));
}

}  // namespace
}  // namespace diastole::explain
