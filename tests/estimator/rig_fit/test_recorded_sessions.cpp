// The base model against recordings of another program in which nothing is hidden (tests/data/rig): whatever is
// left over there is the model's fault, and every later explanation would be wrong by it.

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>

#include "estimator/rig_fit/base_fit.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::rig {
namespace {

TEST(RecordedSessions, WithNothingHiddenTheBaseModelErrsLessThanStated) {
  std::unique_ptr<SpecimenFamily> family;
  const std::vector<std::pair<std::string, double>> sessions{{"case-028", 11.9097}, {"case-009", 5.87946}};
  for (const auto& [name, modulus_kPa] : sessions) {
    const Study study = read_study(test::recorded("rig/" + name) / (name + ".study.toml"));
    if (!family) family = std::make_unique<SpecimenFamily>(study);
    const Session session = read_session(study);
    const SessionProblem problem(session, *family, 2);
    const LinearisedModel base = declared_rig(problem);
    const EvidenceFit fit =
        fit_with_shares(base.target(problem), base.columns, problem.error(), problem.error().prior.share);
    const Nuisance& modulus = problem.nuisances().front();  // its logarithm
    const double sd = modulus.sd * std::sqrt(fit.precision.inverse()(0, 0));
    EXPECT_LT(sd, 0.02) << name;
    EXPECT_NEAR(modulus.mean + modulus.sd * fit.estimate[0], std::log(modulus_kPa), 3.0 * sd) << name;
    // A third of what is stated, which is more than the least that any model is said to err.
    ASSERT_LT(SharePrior::least[0], 0.3 * problem.error().prior.share[0]);
    EXPECT_LT(fit.shares[0], 0.3 * problem.error().prior.share[0]) << name;
  }
}

TEST(RecordedSessions, StatedEffectsHaveTheParametersAndRunsThatTheyName) {
  Study study = read_study(test::recorded("rig/case-030/case-030.study.toml"));
  const Session session = read_session(study);
  const auto message = [&](StudyEffect stated) {
    study.effects = {stated.id};
    study.effect_values = {std::move(stated)};
    return test::message_of([&] { (void)stated_effects(study, session); });
  };
  EXPECT_EQ(message({"hose-compliance", {{"wave_speed_m_s", 50.0}}, {}}), "(no error)");
  EXPECT_THAT(message({"hose-compliance", {{"wave_sped_m_s", 50.0}}, {}}),
              testing::AllOf(testing::HasSubstr("model.parameters.hose-compliance.wave_sped_m_s"),
                             testing::HasSubstr("wave_speed_m_s")));
  const std::string run = session.runs.front().drive.place.name;
  EXPECT_EQ(message({"sensor-offset", {}, {{run, 12.0}}}), "(no error)");
  EXPECT_THAT(message({"sensor-offset", {}, {{"another", 12.0}}}),
              testing::HasSubstr("the study has no run \"another\""));
}

}  // namespace
}  // namespace diastole::rig
