// Broyden's updates of a kept factor, on equations of two unknowns that can be followed by hand.

#include <gtest/gtest.h>

#include "estimator/fe/kept_factor.hpp"

namespace diastole {
namespace {

double dot(std::span<const double> a, std::span<const double> b) { return a[0] * b[0] + a[1] * b[1]; }

/// Steps to the root of a residual with a factor that is the identity; the number it takes, 0 if it gives up.
template <class Residual>
int steps_to_root(const Residual& residual) {
  std::array<double, 2> x{0.0, 0.0};
  const auto simplified = [&] {
    const std::array<double, 2> r = residual(x);
    return std::vector{-r[0], -r[1]};
  };
  std::vector<double> step = simplified();
  KeptFactor factor(dot, step);
  for (int count = 1;; ++count) {
    x = {x[0] + step[0], x[1] + step[1]};
    if (dot(step, step) < 1e-24) return count;
    const auto next = factor.next_step(simplified());
    if (!next) return 0;
    step = *next;
  }
}

std::array<double, 2> linear(const std::array<double, 2>& x, double size) {
  return {1.4 * x[0] + 0.3 * x[1] - size, 0.7 * x[1] + 0.2 * x[0] + 0.5 * size};
}

// Broyden's method ends after at most twice as many steps as there are unknowns, then one to see that it has.
TEST(KeptFactor, LearnsALinearTangent) {
  const int count = steps_to_root([](const auto& x) { return linear(x, 0.1); });
  EXPECT_GT(count, 0);
  EXPECT_LE(count, 5);
}

TEST(KeptFactor, IsNotTrustedWithSlowStepsWhereTheSolutionIsFar) {
  EXPECT_EQ(steps_to_root([](const auto& x) { return linear(x, 10.0); }), 0);
}

TEST(KeptFactor, ConvergesFasterThanTheFactorAlone) {
  const auto bent = [](const auto& x) {
    return std::array{1.5 * x[0] + 0.1 * x[1] * x[1] - 0.4, x[1] + 0.2 * x[0] * x[0] - 0.3};
  };
  const int count = steps_to_root(bent);
  EXPECT_GT(count, 0);
  EXPECT_LE(count, 9);  // alone, the wrong 1.5 halves the error each time: 40
}

TEST(KeptFactor, GivesUpWhereItWouldDiverge) {
  EXPECT_EQ(steps_to_root([](const auto& x) { return std::array{3.0 * x[0] - 1.0, x[1]}; }), 0);
}

}  // namespace
}  // namespace diastole
