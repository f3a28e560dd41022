#include "estimator/rig_fit/tone.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "estimator/rig_fit/simulated_session.hpp"

namespace diastole::rig {
namespace {

class Tones : public testing::Test {
 protected:
  Session session(unsigned seed) const {
    return simulated_session(family_, {.noise_kPa = 0.02, .cycle_sd = 0.004, .seed = seed},
                             {0.0, "parabolic", 40.0, 1.2, 0.0, 12});
  }
  static Session with_tone(Session session, double frequency_Hz, double amplitude_kPa) {
    for (SessionRun& run : session.runs)
      for (size_t k = 0; k < run.sample_s.size(); ++k)
        run.pressure_kPa[Channel::cavity][k] +=
            amplitude_kPa * std::sin(2 * std::numbers::pi * frequency_Hz * run.sample_s[k]);
    return session;
  }
  SpecimenFamily family_ = gel_family();
};

TEST_F(Tones, AreFoundWithFrequencyAndSizeBetweenTheHarmonics) {
  for (const double frequency_Hz : {17.3, 31.415}) {
    const auto tone = find_tone(with_tone(session(2), frequency_Hz, 0.05));
    ASSERT_TRUE(tone) << frequency_Hz;
    EXPECT_NEAR(tone->frequency_Hz, frequency_Hz, tone->resolution_Hz);
    // A tone between two bins shows at least two over pi of its amplitude.
    EXPECT_GT(tone->rms_kPa, 0.6 * 0.05 / std::numbers::sqrt2);
    EXPECT_LT(tone->rms_kPa, 1.1 * 0.05 / std::numbers::sqrt2);
    EXPECT_NEAR(tone->noise_kPa, 0.02, 0.002);
  }
}

TEST_F(Tones, AreNotMadeOfNoiseNorOfCyclesThatDiffer) {
  for (unsigned seed = 1; seed <= 20; ++seed)
    EXPECT_FALSE(find_tone(session(seed))) << seed;
}

TEST_F(Tones, AtAHarmonicOfTheCycleIsPartOfIt) {
  EXPECT_FALSE(find_tone(with_tone(session(2), 15.0 / 1.2, 0.05)));
}

TEST_F(Tones, AreNotLookedForInWindowsWithGaps) {
  Session gapped = with_tone(session(2), 17.3, 0.05);
  for (SessionRun& run : gapped.runs)
    run.pressure_kPa[Channel::cavity][run.sample_s.size() / 2] = std::nan("");
  EXPECT_FALSE(find_tone(gapped));
}

}  // namespace
}  // namespace diastole::rig
