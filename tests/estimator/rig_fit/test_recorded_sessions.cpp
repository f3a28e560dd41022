// The base model against recordings of another program in which nothing is hidden (tests/data/rig): whatever is
// left over there is the model's fault, and every later explanation would be wrong by it.

#include <gtest/gtest.h>

#include <filesystem>

#include "estimator/rig_fit/rig_fit.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::rig {
namespace {

TEST(RecordedSessions, WithNothingHiddenTheBaseModelMeetsTheNoise) {
  std::unique_ptr<SpecimenFamily> family;
  const std::vector<std::pair<std::string, double>> sessions{
      {"case-028", 11.9097}, {"case-050", 8.39819}, {"case-009", 5.87946}};
  for (const auto& [name, modulus_kPa] : sessions) {
    const Study study = read_study(test::recorded("rig/" + name) / (name + ".study.toml"));
    if (!family) family = std::make_unique<SpecimenFamily>(study);
    const Session session = read_session(study);
    const RigProblem problem(session, *family);
    EXPECT_NEAR(problem.base().reduced(), 1.0, 0.05) << name;
    EXPECT_NEAR(problem.base().value("modulus_kPa"), modulus_kPa, 2e-3 * modulus_kPa) << name;
  }
}

}  // namespace
}  // namespace diastole::rig
