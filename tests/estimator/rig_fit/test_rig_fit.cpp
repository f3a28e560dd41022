#include "estimator/rig_fit/rig_fit.hpp"

#include <gtest/gtest.h>

#include "tests/estimator/rig_fit/simulated_session.hpp"

namespace diastole::rig {
namespace {

TEST(RigFit, BaseModelMeetsItsOwnNoise) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const RigProblem problem(session, family);
  EXPECT_EQ(problem.base().termination, inference::Termination::converged);
  EXPECT_NEAR(problem.base().reduced(), 1.0, 0.05);
  EXPECT_NEAR(problem.base().value("modulus_kPa"), 8.0, 4.0 * problem.base().errors[0]);
  EXPECT_NEAR(problem.noise().channels.at(Channel::cavity).sd_kPa, 0.01, 0.001);
  EXPECT_NEAR(problem.noise().channels.at(Channel::pump).sd_kPa, 0.05, 0.008);
  EXPECT_NEAR(problem.noise().channels.at(Channel::cavity).autoregression.front(), 0.7, 0.06);
}

TEST(RigFit, AnEffectThatIsThereStandsOutAndIsFoundAgain) {
  const SpecimenFamily family = gel_family();
  const Effect* leak = find_effect("cannula-leak-cavity");
  const Session session = simulated_session(family, {.terms = {{leak}}, .values = {0.1}});
  const RigProblem problem(session, family);
  EXPECT_GT(problem.base().reduced(), 1.3);
  const RigFit fit = problem.fit({{leak}});
  EXPECT_NEAR(fit.reduced(), 1.0, 0.05);
  EXPECT_NEAR(fit.value("cannula-leak-cavity.leak_mL_s_kPa"), 0.1, 5.0 * fit.errors[3]);
  EXPECT_LT(fit.errors[3], 0.01);
}

TEST(RigFit, CycleVariationOfKnownSizeLeaveTheNoise) {
  const SpecimenFamily family = gel_family();
  constexpr double cycle_sd = 0.008;
  const Session session = simulated_session(family, {.cycle_sd = cycle_sd});
  NoiseModel noise = estimate_noise(simulated_session(family, {}));
  const auto reduced_with = [&](double assumed_sd) {
    noise.cycle_sd = assumed_sd;
    return RigProblem(session, family, {.noise = noise}).base().reduced();
  };
  EXPECT_NEAR(reduced_with(cycle_sd), 1.0, 0.04);
  EXPECT_GT(reduced_with(1e-6), 1.2);
}

TEST(RigFit, CycleVariationMayBeThatOfAModelWithEffects) {
  const SpecimenFamily family = gel_family();
  constexpr double cycle_sd = 0.005;
  const std::vector<ModelTerm> leaking{{find_effect("cannula-leak-cavity")}};
  const Session session =
      simulated_session(family, {.terms = leaking, .values = {1.5}, .cycle_sd = cycle_sd});
  NoiseModel noise = estimate_noise(simulated_session(family, {}));
  noise.cycle_sd = cycle_sd;
  const RigProblem plain(session, family, {.noise = noise});
  const RigFit first = plain.fit(leaking);
  const RigProblem leaky(session, family, {.variation_of = first, .noise = noise});
  const RigFit second = leaky.fit_from(first);
  EXPECT_NEAR(second.reduced(), 1.0, 0.04);
  EXPECT_LT(second.chi_square, first.chi_square);
}

TEST(RigFit, ASearchThatIsCutShortSaysSo) {
  const SpecimenFamily family = gel_family();
  const Session session = simulated_session(family, {});
  const RigProblem problem(session, family, {.iteration_limit = 1});
  const KnownModel far{{}, {0.5 * family.modulus_start_kPa(), 0.0, 0.0}};
  EXPECT_EQ(problem.fit_from(far).termination, inference::Termination::iteration_limit);
}

TEST(RigFit, AMissingSampleCostsOnlyItsNeighbours) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {});
  for (size_t k = 700; k < 720; ++k)
    session.runs[0].pressure_kPa[Channel::cavity][k] = std::numeric_limits<double>::quiet_NaN();
  const RigProblem problem(session, family);
  EXPECT_NEAR(problem.base().reduced(), 1.0, 0.05);
}

}  // namespace
}  // namespace diastole::rig
