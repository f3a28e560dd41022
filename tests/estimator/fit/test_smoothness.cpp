#include "estimator/fit/smoothness.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

TEST(NeighbourDifferences, HaveARowForEachSharedFaceAndVanishForAConstant) {
  AnnulusShape shape;
  shape.elements = {8, 4, 2};
  const Eigen::MatrixXd differences = neighbour_differences(make_annulus(shape));
  ASSERT_EQ(differences.cols(), 64);
  EXPECT_EQ(differences.rows(), 8 * 4 * 2 + 8 * 3 * 2 + 8 * 4 * 1);  // around, along, through
  EXPECT_LT((differences * Eigen::VectorXd::Ones(64)).norm(), 1e-12);
  EXPECT_NEAR(differences.squaredNorm(), 2.0 * static_cast<double>(differences.rows()),
              1e-9);  // mean weight 1
}

TEST(NeighbourDifferences, ACollapsedFaceJoinsNothing) {
  EllipsoidShape shape;
  shape.elements = {6, 3, 1};
  const Eigen::MatrixXd differences = neighbour_differences(make_ellipsoid(shape));
  EXPECT_EQ(differences.rows(), 6 * 3 + 6 * 2);
}

// One block on a chain of n values seen directly with unit noise: a conjugate model whose evidence is known in
// closed form, log p(y) = log N(y; 0, I + step² L⁺) up to the flat mean.
TEST(EvidenceOfStep, IsTheMarginalLikelihoodOfALinearModel) {
  constexpr Eigen::Index count = 12;
  Eigen::MatrixXd differences = Eigen::MatrixXd::Zero(count - 1, count);
  Eigen::VectorXd seen(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    seen[i] = 3 * std::sin(0.5 * static_cast<double>(i)) + (i % 2 == 0 ? 0.7 : -0.7);
    if (i > 0) differences.row(i - 1)[i] = 1, differences.row(i - 1)[i - 1] = -1;
  }
  const QuadraticModel model{Eigen::VectorXd::Zero(count), -seen, Eigen::MatrixXd::Identity(count, count)};
  const EvidenceOfStep found =
      evidence_of_step(model, {{0, differences, 1.0}}, 0, std::vector<bool>(count, true));

  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(differences.transpose() * differences);
  const auto log_likelihood = [&](double step) {
    double sum = 0;
    for (Eigen::Index k = 1; k < count; ++k) {
      const double variance = 1 + step * step / solver.eigenvalues()[k];
      sum -= 0.5 * std::log(variance) + 0.5 * std::pow(solver.eigenvectors().col(k).dot(seen), 2) / variance;
    }
    return sum;
  };
  double best = 0, best_step = 0, total = 0;
  for (const double step : found.steps) {
    if (best_step == 0 || log_likelihood(step) > best) best = log_likelihood(step), best_step = step;
  }
  EXPECT_DOUBLE_EQ(found.step, best_step);
  EXPECT_FALSE(found.none_seen);
  for (const double step : found.steps)
    total += step * std::exp(log_likelihood(step) - best);
  for (size_t i = 0; i < found.steps.size(); ++i) {
    EXPECT_NEAR(found.weights[i], found.steps[i] * std::exp(log_likelihood(found.steps[i]) - best) / total,
                1e-9);
  }
}

class RegionalGel : public testing::Test {
 protected:
  static constexpr size_t elements = 8;  // 4 around, 2 along

  static double truth(size_t element, double amplitude) {
    return 8.7 * (1 + amplitude * std::cos(M_PI / 2 * static_cast<double>(element % 4)));
  }
  static Measurement measured(double amplitude, unsigned seed, double sigma_kPa = 0.02) {
    ElasticModel gel = test::coarse_gel(8.7);
    for (size_t e = 0; e < elements; ++e)
      gel.set_element_parameter(0, e, truth(e, amplitude));
    return test::synthetic(gel, {.tags_a_frame = 250, .sigma_mm = 0.4, .sigma_kPa = sigma_kPa, .seed = seed});
  }
  static FitOutcome fit(const Measurement& measurement, std::optional<SmoothRegion> smooth,
                        Robustness robustness = Robustness::if_needed, double geometry_sigma_mm = 0) {
    ElasticMotion motion(test::coarse_gel(6), each_element(0, elements));
    motion.consider(geometry_errors(motion.model(), geometry_sigma_mm));
    FitOptions options;
    options.robustness = robustness;
    if (smooth) options.smooth = {*smooth};
    return fit_motion(motion, std::vector<EstimatedParameter>(elements, {6.0, 1.0, 20.0}), measurement,
                      options);
  }
  static double rms(const FitOutcome& outcome, double amplitude) {
    double squares = 0;
    for (size_t e = 0; e < elements; ++e)
      squares += std::pow(outcome.values[e].value / truth(e, amplitude) - 1, 2);
    return std::sqrt(squares / static_cast<double>(elements));
  }
};

TEST_F(RegionalGel, WithoutDifferencesTheEvidenceAsksForNone) {
  const Measurement measurement = measured(0, 3);
  const FitOutcome smooth = fit(measurement, SmoothRegion{0, {}}), free = fit(measurement, {});
  ASSERT_TRUE(smooth.converged()) << smooth.reason;
  ASSERT_EQ(smooth.smoothness.size(), 1U);
  EXPECT_LT(rms(smooth, 0), 0.5 * rms(free, 0));
  EXPECT_LT(smooth.smoothness[0].effective_values, 4);
  // Whatever step was chosen, the errors say that another is possible.
  for (const EstimatedValue& value : smooth.values)
    EXPECT_LT(std::abs(value.value - 8.7), 3 * value.se);
  EXPECT_LE(smooth.iterations, 7);
}

// The most probable step would make the map flat; its mean over the steps that the data allow keeps what they saw.
TEST_F(RegionalGel, WeakDifferencesAreNotFlattened) {
  constexpr double weak = 0.08;
  double along = 0, flat = 0;
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    const FitOutcome outcome = fit(measured(weak, seed), SmoothRegion{0, {}});
    ASSERT_TRUE(outcome.converged()) << outcome.reason;
    double mean = 0;
    for (const EstimatedValue& value : outcome.values)
      mean += value.value / static_cast<double>(elements);
    for (size_t e = 0; e < elements; ++e) {
      along += (outcome.values[e].value / mean - 1) * (truth(e, weak) / 8.7 - 1);
      flat += std::pow(truth(e, weak) / 8.7 - 1, 2);
      EXPECT_LE(outcome.values[e].ci95[0], truth(e, weak));
      EXPECT_GE(outcome.values[e].ci95[1], truth(e, weak));
    }
    EXPECT_NE(outcome.values[0].value, outcome.values[2].value);
  }
  // The share of the true contrast that the maps show.
  RecordProperty("contrast_found", std::to_string(along / flat));
  EXPECT_GT(along / flat, 0.25);
  EXPECT_LT(along / flat, 1.2);
}

TEST_F(RegionalGel, DifferencesThatTheDataShowAreKept) {
  const FitOutcome outcome = fit(measured(0.3, 1), SmoothRegion{0, {}});
  ASSERT_TRUE(outcome.converged()) << outcome.reason;
  EXPECT_FALSE(outcome.smoothness[0].none_seen);
  EXPECT_GT(outcome.smoothness[0].step, 0.08);
  EXPECT_LT(outcome.smoothness[0].step90[0], outcome.smoothness[0].step);
  EXPECT_GT(outcome.smoothness[0].step90[1], outcome.smoothness[0].step);
  EXPECT_GT(outcome.smoothness[0].effective_values, 3);
  EXPECT_LT(outcome.unknowns, 10);
  EXPECT_LT(rms(outcome, 0.3), 0.08);
}

TEST_F(RegionalGel, ARobustLossChangesItsErrorsAsItDoesWithoutSmoothing) {
  const Measurement measurement = measured(0.3, 1);
  const auto mean_ratio = [&](std::optional<SmoothRegion> smooth) {
    const FitOutcome normal = fit(measurement, smooth, Robustness::never),
                     robust = fit(measurement, smooth, Robustness::always);
    EXPECT_TRUE(normal.converged() && robust.converged());
    double sum = 0;
    for (size_t e = 0; e < elements; ++e)
      sum += robust.values[e].se / normal.values[e].se;
    return sum / static_cast<double>(elements);
  };
  const double free = mean_ratio({}), given = mean_ratio(SmoothRegion{0, 0.2}),
               by_evidence = mean_ratio(SmoothRegion{0, {}});
  EXPECT_GT(free, 0.95);
  EXPECT_NEAR(given, free, 0.05);
  EXPECT_NEAR(by_evidence, free, 0.08);
}

TEST_F(RegionalGel, WhatTheSmoothnessAddsIsNotThePressures) {
  const FitOutcome outcome = fit(measured(0.08, 1, 0), SmoothRegion{0, {}});
  for (const EstimatedValue& value : outcome.values) {
    ASSERT_TRUE(value.shares);
    EXPECT_NEAR(value.shares->pressures, 0, 1e-9);
  }
}

TEST_F(RegionalGel, IntervalsByEvidenceHoldTheErrorsOfTheWalls) {
  const Measurement measurement = measured(0.08, 1);
  const FitOutcome without = fit(measurement, SmoothRegion{0, {}}),
                   with = fit(measurement, SmoothRegion{0, {}}, Robustness::if_needed, 0.5);
  for (size_t e = 0; e < elements; ++e) {
    const auto width = [&](const FitOutcome& of) {
      return std::log(of.values[e].ci95[1] / of.values[e].ci95[0]);
    };
    EXPECT_GT(with.values[e].se, 1.02 * without.values[e].se);
    EXPECT_NEAR(width(with) / width(without), with.values[e].se / without.values[e].se, 1e-6);
  }
}

TEST_F(RegionalGel, AGivenStepIsKept) {
  const Measurement measurement = measured(0.3, 1);
  const FitOutcome stiff = fit(measurement, SmoothRegion{0, 1e-4}),
                   loose = fit(measurement, SmoothRegion{0, 100.0});
  EXPECT_NEAR(stiff.values[0].value, stiff.values[2].value, 1e-3);
  EXPECT_NEAR(stiff.smoothness[0].effective_values, 1, 0.01);
  const FitOutcome free = fit(measurement, {});
  for (size_t e = 0; e < elements; ++e) {
    EXPECT_NEAR(loose.values[e].value, free.values[e].value, 1e-3);
    EXPECT_NEAR(loose.values[e].se, free.values[e].se, 1e-3);
  }
}

}  // namespace
}  // namespace diastole
