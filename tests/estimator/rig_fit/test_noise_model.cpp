#include "estimator/rig_fit/noise_model.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::rig {
namespace {

TEST(NoiseModel, FindsTheNoiseThatWasAdded) {
  const SpecimenFamily family = gel_family();
  const NoiseModel noise = estimate_noise(simulated_session(family, {}));
  EXPECT_NEAR(noise.channels.at(Channel::cavity).sd_kPa, 0.01, 0.001);
  EXPECT_NEAR(noise.channels.at(Channel::pump).sd_kPa, 0.05, 0.008);
  EXPECT_NEAR(noise.channels.at(Channel::cavity).autoregression.front(), 0.7, 0.06);
}

TEST(NoiseModel, ATransientThatDiesAwayOverTheCyclesIsNoNoise) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {.seed = 3});
  const NoiseModel before = estimate_noise(session);
  for (SessionRun& run : session.runs) {
    for (size_t k = 0; k < run.sample_s.size(); ++k) {
      const double since_s = run.sample_s[k] - 1.2;
      if (since_s > 0.0)
        run.pressure_kPa.at(Channel::cavity)[k] += 0.5 * std::exp(-since_s / 2.0) * std::sin(3.0 * since_s);
    }
  }
  const NoiseModel after = estimate_noise(session);
  EXPECT_NEAR(after.channels.at(Channel::cavity).sd_kPa, before.channels.at(Channel::cavity).sd_kPa,
              0.1 * before.channels.at(Channel::cavity).sd_kPa);
}

TEST(NoiseModel, LouderNoiseInMotionCounts) {
  const SpecimenFamily family = gel_family();
  Session session = simulated_session(family, {.noise_kPa = 0.01, .seed = 4});
  const Session loud = simulated_session(family, {.noise_kPa = 0.03, .seed = 4});
  const NoiseModel quiet = estimate_noise(session);
  for (size_t r = 0; r < session.runs.size(); ++r)
    for (size_t k = 0; k < session.runs[r].sample_s.size(); ++k)
      if (session.runs[r].sample_s[k] > 1.2)
        session.runs[r].pressure_kPa[Channel::cavity][k] = loud.runs[r].pressure_kPa.at(Channel::cavity)[k];
  const NoiseModel louder = estimate_noise(session);
  EXPECT_GT(louder.channels.at(Channel::cavity).sd_kPa, 1.5 * quiet.channels.at(Channel::cavity).sd_kPa);
}

}  // namespace
}  // namespace diastole::rig
