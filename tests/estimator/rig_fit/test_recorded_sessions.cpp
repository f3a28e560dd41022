// The base model against recordings of another program in which nothing is hidden (tests/data/rig): whatever is
// left over there is the model's fault, and every later explanation would be wrong by it.

#include <gtest/gtest.h>

#include "estimator/rig_fit/base_fit.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::rig {
namespace {

TEST(RecordedSessions, WithNothingHiddenTheBaseModelErrsLessThanStated) {
  std::unique_ptr<SpecimenFamily> family;
  const std::vector<std::pair<std::string, double>> sessions{
      {"case-028", 11.9097}, {"case-050", 8.39819}, {"case-009", 5.87946}};
  for (const auto& [name, modulus_kPa] : sessions) {
    const Study study = read_study(test::recorded("rig/" + name) / (name + ".study.toml"));
    if (!family) family = std::make_unique<SpecimenFamily>(study);
    const Session session = read_session(study);
    const SessionProblem problem(session, *family, 2);
    const LinearisedModel base = declared_rig(problem);
    EXPECT_NEAR(problem.model(base.at).modulus_kPa, modulus_kPa, 5e-3 * modulus_kPa) << name;
    const EvidenceFit fit =
        fit_with_shares(base.target(problem), base.columns, problem.error(), problem.error().prior.share);
    EXPECT_LT(fit.shares[0], 0.2 * problem.error().prior.share[0]) << name;
  }
}

}  // namespace
}  // namespace diastole::rig
