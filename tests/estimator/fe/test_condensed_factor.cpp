// The tangent without its pressures: the same solutions as of the whole matrix, only where that is that of a stable body.

#include <gtest/gtest.h>

#include "estimator/fe/condensed_factor.hpp"
#include "estimator/fe/sparse_factor.hpp"
#include "tests/estimator/fe/derivative_check.hpp"
#include "tests/estimator/fe/gel.hpp"

namespace diastole {
namespace {

ElasticModel small_gel(ElasticOptions options = {}) { return gel(6.5, {5, 3, 2}, std::move(options)); }

std::shared_ptr<CondensedPattern> pattern_of(const EquationSystem& equations) {
  const size_t entries = equations.entries();
  return CondensedPattern::of(equations.displacement_unknowns(), equations.pressure_unknowns(),
                              equations.rows().first(entries), equations.columns().first(entries));
}

TEST(CondensedFactor, SolvesLikeTheWholeMatrix) {
  ElasticModel model = small_gel();
  const EquationSystem& equations = model.system().equations();
  std::vector<double> values = model.system().tangent(model.solve(3.0).state);
  const auto condensed = CondensedFactor::of(pattern_of(equations), values);
  ASSERT_TRUE(condensed);
  SparseFactor whole(equations.unknowns(), equations.rows().first(values.size()),
                     equations.columns().first(values.size()));
  ASSERT_EQ(whole.factorise(values).negative_pivots, equations.pressure_unknowns());
  std::vector<double> one = random_step(equations.unknowns(), 1);
  const std::vector<double> second = random_step(equations.unknowns(), 2);
  one.insert(one.end(), second.begin(), second.end());
  std::vector<double> other = one;
  condensed->solve(one, 2);
  whole.solve(other, 2);
  const auto part = [&](const std::vector<double>& numbers, size_t column,
                        bool pressures) -> Eigen::VectorXd {
    const size_t first = column * equations.unknowns();
    const size_t middle = first + equations.displacement_unknowns(), last = first + equations.unknowns();
    return Eigen::Map<const Eigen::VectorXd>(
        &numbers[pressures ? middle : first],
        static_cast<Eigen::Index>(pressures ? last - middle : middle - first));
  };
  for (const size_t column : {0U, 1U}) {
    for (const bool pressures : {false, true}) {
      const Eigen::VectorXd expected = part(other, column, pressures);
      EXPECT_LT((part(one, column, pressures) - expected).norm(), 1e-8 * expected.norm());
    }
  }
}

TEST(CondensedFactor, IsNoneOfAnUnstableBody) {
  ElasticModel model = small_gel();
  ElasticState pulled_in = model.rest_state();
  for (double& pressure : pulled_in.lagrange_pressure_kPa)
    pressure += 100.0;
  const std::vector<double> values = model.system().tangent(pulled_in);
  EXPECT_FALSE(CondensedFactor::of(pattern_of(model.system().equations()), values));
}

TEST(CondensedFactor, IsNoneOfABodyThatIsFree) {
  ElasticModel model = small_gel({.held = hold_nothing(make_annulus(gel_shape({5, 3, 2})))});
  const std::vector<double> values = model.system().tangent(model.rest_state());
  EXPECT_FALSE(CondensedFactor::of(pattern_of(model.system().equations()), values));
}

TEST(CondensedFactor, HasNoPatternWhereCondensationWouldAddEntries) {
  EXPECT_FALSE(pattern_of(small_gel({.pressure_space = PressureSpace::continuous}).system().equations()));
  EXPECT_FALSE(pattern_of(small_gel({.bulk_modulus_kPa = 100.0}).system().equations()));
}

TEST(CondensedFactor, KeptLeadsToTheSameEquilibriumNearBy) {
  ElasticModel model = small_gel();
  const Solution at_3 = model.solve(3.0);
  (void)model.sensitivities(at_3.state, {});
  const auto kept = model.system().kept_factor();
  ASSERT_TRUE(kept);
  model.set_parameter(0, 6.0);
  const Solution with = model.solve({3.3}, at_3.state, kept);
  const Solution without = model.solve(3.3, at_3.state);
  EXPECT_TRUE(with.report.converged());
  EXPECT_EQ(with.report.factorisations, 0U);
  double apart_mm = 0;
  for (size_t i = 0; i < with.state.position_mm.size(); ++i)
    apart_mm = std::max(apart_mm, std::abs(with.state.position_mm[i] - without.state.position_mm[i]));
  EXPECT_LT(apart_mm, 1e-6);
}

}  // namespace
}  // namespace diastole
