// The trial of a user's effect: what it must not pass.

#include "estimator/explain/rig/effect_trial.hpp"

#include <gmock/gmock.h>

#include "estimator/explain/rig/port_law.hpp"

namespace diastole::explain {
namespace {

using testing::HasSubstr;

/// Of a size `G` and, where the equation reads it, a pressure at which leaks open.
std::shared_ptr<const Effect> effect_with(const std::string& port, const std::string& unit,
                                          const std::string& equation) {
  const bool opens = equation.find("p_lift") != std::string::npos;
  return effect_of_text(
      "format = \"diastole-effect\"\nversion = 1\nid = \"mine\"\ntitle = \"mine\"\nport = \"" + port +
      "\"\n[[parameter]]\nname = \"G\"\nunit = \"" + unit +
      "\"\nneutral = 0.0\nbounds = [0.0, 1.0]\ntypical = 0.05\n" +
      (opens ? "[[parameter]]\nname = \"p_lift\"\nunit = \"kPa\"\nneutral = 5.0\nbounds = [0.5, 20.0]\n"
               "scale = \"logarithmic\"\n"
             : "") +
      "[equations]\n" + equation + "\n");
}

TEST(EffectTrial, FindsNothingWhereThereAreNoPressures) {
  const auto effect = effect_with("sensor", "kPa", "p_seen = \"p + G * log(1 - t / 2 [s])\"");
  const EffectTrial trial(*effect);
  for (const EffectCheck& check : {trial.found_again(), trial.silent()}) {
    EXPECT_FALSE(check.passed) << check.name;
    EXPECT_THAT(check.detail, HasSubstr("no finite pressures"));
  }
}

TEST(EffectTrial, FindsNoEffectThatDoesNothing) {
  const auto effect = effect_with("sensor", "kPa", "p_seen = \"p + 0 * G\"");
  EXPECT_FALSE(EffectTrial(*effect).found_again().passed);
}

/// The sensor's offset is unknown as it is: a constant that is added is neither found nor refuted.
TEST(EffectTrial, LeavesASizeOpenThatIsKnownToItselfOnly) {
  const auto effect = effect_with("sensor", "kPa", "p_seen = \"p + G\"");
  const EffectCheck check = EffectTrial(*effect).found_again();
  EXPECT_EQ(check.outcome(), "open") << check.detail;
}

TEST(EffectTrial, DifferentiatesByThePressureAtWhichALeakOpens) {
  const auto opens =
      effect_with("drive", "mL/(s kPa)", "q_hose = \"q_piston - G * max(p_pump - p_lift, 0)\"");
  const EffectCheck check = EffectTrial(*opens).differentiable();
  EXPECT_TRUE(check.passed) << check.detail;
}

}  // namespace
}  // namespace diastole::explain
