#include "estimator/imaging/flow/periodic_regression.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "estimator/imaging/flow/phase_unwrapping.hpp"

namespace diastole::imaging {
namespace {

constexpr double period_s = 1.2;
constexpr double w = 2 * std::numbers::pi / period_s;

struct Samples {
  Eigen::VectorXd time_s, values;
  Eigen::MatrixXd covariance;
};

/// 30 sin w(t - 0.05) + 4 cos 3 w t + offset, at the middles of 16 phases, with noise.
double course(double t, double offset) {
  return 30 * std::sin(w * (t - 0.05)) + 4 * std::cos(3 * w * t) + offset;
}

Samples samples(double sigma, double offset, unsigned seed, int count = 16) {
  std::mt19937 engine(seed);
  std::normal_distribution<double> noise(0, 1);
  Samples made{Eigen::VectorXd(count), Eigen::VectorXd(count),
               Eigen::MatrixXd::Identity(count, count) * sigma * sigma};
  for (int k = 0; k < count; ++k) {
    made.time_s[k] = period_s * (k + 0.5) / count;
    made.values[k] = course(made.time_s[k], offset) + sigma * noise(engine);
  }
  return made;
}

TEST(PeriodicRegression, IntegralAndSlopeAreThoseOfTheValue) {
  const Samples data = samples(0.1, 1.0, 1);
  const PeriodicRegression curve = periodic_regression(data.time_s, data.values, data.covariance, period_s);
  constexpr double t = 0.37, h = 1e-4;
  const auto value = [&](double at) { return curve.of(curve.value_row(at)); };
  EXPECT_NEAR(curve.of(curve.slope_row(t)), (value(t + h) - value(t - h)) / (2 * h), 1e-4);
  EXPECT_NEAR((curve.of(curve.integral_row(t + h)) - curve.of(curve.integral_row(t - h))) / (2 * h), value(t),
              1e-5);
  EXPECT_NEAR(value(0), value(period_s), 1e-9);
}

TEST(PeriodicRegression, ItsErrorsCoverTheTruthBetweenTheSamples) {
  int within = 0, all = 0;
  double squares = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Samples data = samples(0.5, 2.0, seed);
    const PeriodicRegression curve = periodic_regression(data.time_s, data.values, data.covariance, period_s);
    for (const double t : {0.0, 0.21, 0.5, 0.93}) {
      const Eigen::VectorXd row = curve.value_row(t);
      const double z = (curve.of(row) - course(t, 2.0)) / curve.sigma_of(row);
      squares += z * z;
      within += std::abs(z) < 1.96 ? 1 : 0;
      ++all;
    }
  }
  // 160 values of which neighbours share noise: their share has a standard error of two percent.
  EXPECT_GT(within, 0.88 * all);
  EXPECT_GT(squares, 0.5 * all);
  EXPECT_LT(squares, 1.5 * all);
}

TEST(PeriodicRegression, WhatACycleDoesNotReturnIsFoundAndCanBeTakenOff) {
  Samples data = samples(0.2, 1.5, 3);
  data.covariance.array() += 4.0;  // an error that all samples share, as a background's
  const PeriodicRegression open = periodic_regression(data.time_s, data.values, data.covariance, period_s);
  const Eigen::VectorXd whole = open.integral_row(period_s);
  EXPECT_NEAR(open.of(whole), 1.5 * period_s, 0.1);
  EXPECT_NEAR(open.sigma_of(whole), 2.0 * period_s, 0.2);
  const PeriodicRegression shut = closed(open);
  EXPECT_NEAR(shut.of(whole), 0, 1e-9);
  EXPECT_NEAR(shut.sigma_of(whole), 0, 1e-6);
  // The shared error goes with it.
  EXPECT_NEAR(shut.of(shut.value_row(0.3)), course(0.3, 0), 0.5);
  EXPECT_LT(shut.sigma_of(shut.value_row(0.3)), 0.3 * open.sigma_of(open.value_row(0.3)));
}

TEST(PhaseUnwrapping, PutsTurnsBackWhereTheCourseIsSmooth) {
  std::vector<double> truth, wrapped;
  const std::vector<double> gap(16, 1.0);
  for (int k = 0; k < 16; ++k) {
    truth.push_back(5.0 * std::sin(2 * std::numbers::pi * (k + 0.5) / 16));
    wrapped.push_back(std::remainder(truth.back(), 2 * std::numbers::pi));
  }
  const UnwrappedCycle cycle = unwrapped(wrapped, gap);
  for (size_t k = 0; k < truth.size(); ++k)
    EXPECT_NEAR(cycle.phase_rad[k], truth[k], 1e-12) << k;
  EXPECT_EQ(cycle.turns[4], 1);
  EXPECT_EQ(cycle.turns[12], -1);
}

TEST(PhaseUnwrapping, AWholeCourseBeyondHalfATurnIsBroughtNearestToZero) {
  const UnwrappedCycle cycle = unwrapped({3.0, -3.1, -3.0, 3.1}, {1, 1, 1, 1});
  EXPECT_NEAR(cycle.phase_rad[1] - cycle.phase_rad[0], 2 * std::numbers::pi - 6.1, 1e-12);
  double mean = 0;
  for (const double phase : cycle.phase_rad)
    mean += phase / 4;
  EXPECT_LT(std::abs(mean), std::numbers::pi + 1e-9);
}

}  // namespace
}  // namespace diastole::imaging
