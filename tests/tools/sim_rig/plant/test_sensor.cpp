#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "tools/sim_rig/plant/second_order.hpp"
#include "tools/sim_rig/plant/sensor.hpp"

namespace diastole::sim_rig {
namespace {

constexpr double step_s = 0.000625;

TEST(SecondOrder, SettlesOnAConstantAndRingsAtItsFrequency) {
  SecondOrder line(50, 0.02, step_s);
  double before = 0;
  std::vector<double> crossings_s;
  for (int i = 1; i <= 400; ++i) {
    line.advance(1);
    const double deviation = line.value() - 1;
    if (before * deviation < 0) {
      crossings_s.push_back((i - deviation / (deviation - before)) * step_s);
    }
    before = deviation;
  }
  const double frequency_Hz =
      static_cast<double>(crossings_s.size() - 1) / (2 * (crossings_s.back() - crossings_s.front()));
  EXPECT_NEAR(frequency_Hz, 50 * std::sqrt(1 - 0.02 * 0.02), 0.05);
  for (int i = 0; i < 20000; ++i)
    line.advance(1);
  EXPECT_NEAR(line.value(), 1, 1e-9);
}

TEST(SecondOrder, AnswersAtItsNaturalFrequencyWithOneOverTwoZeta) {
  SecondOrder line(60, 0.6, step_s / 50);
  double largest = 0;
  for (int i = 0; i < 20000; ++i) {
    line.advance(std::sin(2 * std::numbers::pi * 60 * (i + 0.5) * step_s / 50));
    if (i > 10000) largest = std::max(largest, std::abs(line.value()));
  }
  EXPECT_NEAR(largest, 1 / (2 * 0.6), 0.002);
}

TEST(Sensor, NoiseHasItsDeviationAndCorrelationTime) {
  Sensor sensor({.noise_kPa = 0.03, .noise_correlation_ms = 10, .bits = 0}, step_s, 7);
  std::vector<double> noise;
  for (int i = 0; i < 400'000; ++i) {
    sensor.advance(0);
    noise.push_back(sensor.reading_kPa(0));
  }
  const size_t lag = 16;  // 10 ms
  double variance = 0;
  double covariance = 0;
  for (size_t i = 0; i + lag < noise.size(); ++i) {
    variance += noise[i] * noise[i];
    covariance += noise[i] * noise[i + lag];
  }
  EXPECT_NEAR(std::sqrt(variance / static_cast<double>(noise.size())), 0.03, 0.001);
  EXPECT_NEAR(covariance / variance, std::exp(-1), 0.03);
}

TEST(Sensor, ReadsInTheConvertersStepsAndClipsAtItsRange) {
  Sensor sensor({.offset_kPa = 0.0137, .range_kPa = 20, .bits = 12}, step_s, 1);
  const double lsb_kPa = 40.0 / 4096;
  const double steps = sensor.reading_kPa(0) / lsb_kPa;
  EXPECT_DOUBLE_EQ(steps, std::round(steps));
  EXPECT_NEAR(sensor.reading_kPa(0), 0.0137, lsb_kPa / 2);
  for (int i = 0; i < 1000; ++i)
    sensor.advance(50);
  EXPECT_DOUBLE_EQ(sensor.reading_kPa(0), 20);
}

TEST(Sensor, TheSameSeedGivesTheSameReadings) {
  const auto readings = [](uint64_t seed) {
    Sensor sensor({.noise_kPa = 0.03}, step_s, seed);
    std::vector<double> list;
    for (int i = 0; i < 100; ++i) {
      sensor.advance(1);
      list.push_back(sensor.reading_kPa(0));
    }
    return list;
  };
  EXPECT_EQ(readings(3), readings(3));
  EXPECT_NE(readings(3), readings(4));
}

}  // namespace
}  // namespace diastole::sim_rig
