// Steps of known frequency and damping, with correlated noise and the steps of a 12-bit converter.

#include "estimator/catheter/step_fit.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <random>

namespace diastole::signal {
namespace {

using testing::HasSubstr;

struct Recording {
  std::vector<double> time_s, pressure_kPa;
};

struct PopTest {
  SecondOrder system{60, 0.6};
  std::vector<double> at_s{2.0013};
  double level_kPa = 10;
  double noise_kPa = 0.03;
  double correlation_s = 0.01;
  double resolution_kPa = 20.0 / 2048;
  double rate_Hz = 300;
  double length_s = 4;
};

/// Level after level: down to 0 at the first moment, up at the next, ...
Recording record(const PopTest& test, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const double kept = std::exp(-1 / (test.correlation_s * test.rate_Hz));
  double noise = normal(random);
  Recording recording;
  for (int i = 0; i < static_cast<int>(test.length_s * test.rate_Hz); ++i) {
    const double t = i / test.rate_Hz;
    noise = kept * noise + std::sqrt(1 - kept * kept) * normal(random);
    double pressure_kPa = test.level_kPa + test.noise_kPa * noise;
    double jump_kPa = -test.level_kPa;
    for (const double at_s : test.at_s) {
      pressure_kPa += jump_kPa * unit_step(test.system, t - at_s);
      jump_kPa = -jump_kPa;
    }
    recording.time_s.push_back(t);
    recording.pressure_kPa.push_back(test.resolution_kPa * std::round(pressure_kPa / test.resolution_kPa));
  }
  return recording;
}

CatheterResponse fit(const Recording& recording) {
  return fit_catheter(recording.time_s, recording.pressure_kPa);
}

bool holds(const Estimate& estimate, double truth) {
  return estimate.ci95[0] <= truth && truth <= estimate.ci95[1];
}

class KnownCatheter : public testing::TestWithParam<SecondOrder> {};

TEST_P(KnownCatheter, IsFoundFromOneStep) {
  const CatheterResponse response = fit(record({.system = GetParam()}, 3));
  ASSERT_EQ(response.refusal, "");
  EXPECT_NEAR(response.f0_Hz.value / GetParam().f0_Hz, 1,
              std::max(0.01, 4 * response.f0_Hz.se / GetParam().f0_Hz));
  EXPECT_NEAR(response.zeta.value, GetParam().zeta, 4 * response.zeta.se + 0.005);
  EXPECT_LT(response.minus_3dB_Hz.se / response.minus_3dB_Hz.value, 0.05);
  ASSERT_EQ(response.steps.size(), 1U);
  EXPECT_NEAR(response.steps[0].time_s, 2.0013, 0.001);
  EXPECT_NEAR(response.steps[0].jump_kPa, -10, 0.1);
  EXPECT_THAT(response.remarks, testing::IsEmpty());
}

INSTANTIATE_TEST_SUITE_P(StepFit, KnownCatheter,
                         testing::Values(SecondOrder{60, 0.6}, SecondOrder{30, 0.2}, SecondOrder{15, 0.4},
                                         SecondOrder{40, 1.0}, SecondOrder{25, 1.6}, SecondOrder{90, 0.3}));

TEST(StepFit, IntervalsCoverTheTruthAsOftenAsTheySay) {
  constexpr int repeats = 150;
  int f0 = 0, zeta = 0, cutoff = 0;
  for (unsigned seed = 0; seed < repeats; ++seed) {
    const PopTest test{.at_s = {2 + 0.0001 * seed}, .noise_kPa = 0.06};
    const CatheterResponse response = fit(record(test, 100 + seed));
    ASSERT_EQ(response.refusal, "");
    f0 += holds(response.f0_Hz, test.system.f0_Hz) ? 1 : 0;
    zeta += holds(response.zeta, test.system.zeta) ? 1 : 0;
    cutoff += holds(response.minus_3dB_Hz, minus_3dB_Hz(test.system)) ? 1 : 0;
  }
  for (const int covered : {f0, zeta, cutoff}) {
    EXPECT_GE(covered, 0.89 * repeats);
    EXPECT_LE(covered, 0.995 * repeats);
  }
}

TEST(StepFit, SeveralStepsAreAveraged) {
  const CatheterResponse one = fit(record({}, 8));
  const CatheterResponse four = fit(record({.at_s = {1.5, 3.2, 4.9, 6.6}, .length_s = 9}, 8));
  ASSERT_EQ(four.steps.size(), 4U);
  EXPECT_LT(four.f0_Hz.se, 0.8 * one.f0_Hz.se);
  EXPECT_NEAR(four.f0_Hz.value, 60, 4 * four.f0_Hz.se);
}

TEST(StepFit, ARecordingWithoutAStepIsRefusedInWords) {
  Recording wave = record({.at_s = {}}, 1);
  for (size_t i = 0; i < wave.time_s.size(); ++i)
    wave.pressure_kPa[i] += 2 * std::sin(2 * M_PI * wave.time_s[i] / 1.2);
  EXPECT_THAT(fit(wave).refusal, HasSubstr("no step between two quiet levels"));
  EXPECT_THAT(fit(record({.at_s = {}}, 2)).refusal, HasSubstr("largest change within 60 ms"));
  EXPECT_THAT(fit({}).refusal, HasSubstr("no sample"));
}

TEST(StepFit, AStepWithMissingSamplesIsLeftOutAndReported) {
  Recording recording = record({.at_s = {1.5, 3.2}, .length_s = 5}, 4);
  recording.pressure_kPa[static_cast<size_t>(1.55 * 300)] = std::numeric_limits<double>::quiet_NaN();
  const CatheterResponse response = fit(recording);
  ASSERT_EQ(response.steps.size(), 1U);
  EXPECT_NEAR(response.steps[0].time_s, 3.2, 0.001);
  ASSERT_EQ(response.remarks.size(), 1U);
  EXPECT_THAT(response.remarks[0], HasSubstr("samples are missing"));
}

TEST(StepFit, AResponseThatIsNotOfSecondOrderIsReported) {
  Recording recording = record({.system = {40, 0.3}}, 5);
  for (size_t i = 0; i < recording.time_s.size(); ++i) {
    const double after_s = recording.time_s[i] - 2.0013;
    if (after_s > 0)
      recording.pressure_kPa[i] += 2 * std::sin(2 * M_PI * 17 * after_s) * std::exp(-after_s / 0.1);
  }
  EXPECT_THAT(fit(recording).remarks, testing::Contains(HasSubstr("not quite a second-order response")));
}

}  // namespace
}  // namespace diastole::signal
