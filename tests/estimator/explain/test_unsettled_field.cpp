// A search in imaged motion that is forced to end early.

#include <gtest/gtest.h>

#include "estimator/explain/imaging/explain_field.hpp"
#include "tests/estimator/explain/simulated_field.hpp"

namespace diastole::explain {
namespace {

TEST(ExplainField, NamesNothingByASearchThatDidNotConverge) {
  FieldCase field = simulated_case({.truth = {.displacement_gain = 1.2}});
  field.C1_start_kPa.value = 2.0;
  field.iteration_limit = 1;
  const Explanation found = explain_field(field, "forced");
  EXPECT_EQ(found.verdict, Verdict::unexplained);
  EXPECT_TRUE(found.effects.empty());
  EXPECT_FALSE(found.converged);
  ASSERT_FALSE(found.searches.empty());
  EXPECT_EQ(found.searches.front().termination, inference::Termination::iteration_limit);
  EXPECT_NE(found.summary.find("did not converge"), std::string::npos) << found.summary;
}

}  // namespace
}  // namespace diastole::explain
