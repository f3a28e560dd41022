#include "host/calibration/at_rest.hpp"

#include <gmock/gmock.h>

#include <random>

#include "tests/host/acquisition/session_on_desk.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

std::vector<double> series(double mean_V, double noise_V, double drift_V, size_t count = 1500) {
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0, 1);
  std::vector<double> volts;
  for (size_t i = 0; i < count; ++i) {
    const double part = static_cast<double>(i) / static_cast<double>(count - 1) - 0.5;
    volts.push_back(mean_V + drift_V * part + noise_V * noise(random));
  }
  return volts;
}

TEST(AtRest, MeanNoiseAndDriftAreThoseOfTheSamples) {
  const AtRest reading = at_rest(series(0.5, 0.01, 0.2), 300);
  EXPECT_EQ(reading.samples, 1500U);
  EXPECT_NEAR(reading.mean_V, 0.5, 1e-3);
  EXPECT_NEAR(reading.sd_V, 0.01, 1e-3);
  EXPECT_NEAR(reading.drift_V, 0.2, 5e-3);
}

TEST(AtRest, AQuietChannelIsAccepted) {
  EXPECT_THAT(objection_to(at_rest(series(0.01, 0.005, 0), 300), 4, 1500), IsEmpty());
  EXPECT_THAT(objection_to(at_rest(series(0.01, 0, 0), 300), 4, 1500), IsEmpty());
}

TEST(AtRest, NoiseDriftAndMissingSamplesAreRefusedInWords) {
  EXPECT_THAT(objection_to(at_rest(series(0, 0.1, 0), 300), 4, 1500), HasSubstr("the noise is 0."));
  EXPECT_THAT(objection_to(at_rest(series(0, 0.005, -0.1), 300), 4, 1500), HasSubstr("it drifted by 0."));
  EXPECT_THAT(objection_to(at_rest(series(0, 0.005, 0), 300), 4, 1800), HasSubstr("only 1500 of 1800"));
  EXPECT_THAT(objection_to(at_rest(series(0, 0.005, -0.1), 300), -4, 1500), HasSubstr("drifted"));
}

TEST(AtRest, SamplesAreTakenWhileTheControllerHearsTheHost) {
  SessionOnDesk session(short_session);
  session.client.connect();
  const auto source = make_source(session.clock, session.instrument);
  const auto samples =
      sample_at_rest(session.clock, session.client, *source, 1, 300, 2, [] { return false; });
  ASSERT_EQ(samples.size(), 1U);
  EXPECT_NEAR(static_cast<double>(samples[0].size()), 600, 2);
  EXPECT_TRUE(session.client.connected());
}

}  // namespace
}  // namespace diastole
