// Fits of a shape that was imaged under load: exact derivatives, the stiffness found, and what ignoring the load costs.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/fit/unloaded_motion.hpp"
#include "estimator/mesh/placed_mesh.hpp"
#include "tests/estimator/fe/ventricle.hpp"
#include "tests/estimator/fit/synthetic.hpp"

namespace diastole {
namespace {

constexpr double true_C1_kPa = 8.71, imaged_kPa = 2.0;

/// The coarse gel as it looks at 2 kPa, taken as a shape by itself.
ElasticModel imaged_gel(double C1_kPa) {
  ElasticModel truth = test::coarse_gel(true_C1_kPa);
  const HermiteMesh imaged = with_reference(truth.mesh(), truth.solve(imaged_kPa).state.position_mm);
  return {imaged, *find_law("neo-hookean"), {.parameters = {C1_kPa}}};
}

/// Points of the material, by where they are in the image and in frames at other pressures.
Measurement seen_from_the_image(const std::vector<double>& pressures_kPa, double sigma_mm, double sigma_kPa) {
  ElasticModel truth = test::coarse_gel(true_C1_kPa);
  const HermiteMesh& mesh = truth.mesh();
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const NodeField image = truth.solve(imaged_kPa).state.position_mm;
  Measurement measurement;
  measurement.frames.push_back({0.0, imaged_kPa, sigma_kPa});
  for (const double pressure_kPa : pressures_kPa) {
    const auto frame = static_cast<int>(measurement.frames.size());
    measurement.frames.push_back({0.1 * frame, pressure_kPa, sigma_kPa});
    const NodeField position = truth.solve(pressure_kPa).state.position_mm;
    for (size_t i = 0; i < 200; ++i) {
      const MaterialPoint point{i % mesh.element_count(), {unit(random), unit(random), unit(random)}};
      const Eigen::Vector3d X = mesh.value(image, point), x = mesh.value(position, point);
      ObservedPoint& seen = measurement.points.emplace_back();
      seen = {frame, {X[0], X[1], X[2]}, {x[0], x[1], x[2]}, sigma_mm};
      for (double& component : seen.x_mm)
        component += sigma_mm * normal(random);
    }
  }
  return measurement;
}

double fault(const NodeField& above, const NodeField& below, double h, const NodeField& exact) {
  double largest = 0.0, worst = 0.0;
  for (size_t i = 0; i < exact.size(); ++i) {
    largest = std::max(largest, std::abs(exact[i]));
    worst = std::max(worst, std::abs((above[i] - below[i]) / (2 * h) - exact[i]));
  }
  return worst / largest;
}

TEST(UnloadedFit, DerivativesAreTotalOnes) {
  const EllipsoidShape shape{.elements = {4, 2, 1}};
  UnloadedMotion motion(ventricle(shape, {60.0, -60.0}, {3.0, 11.09, 1.76, 10.0}),
                        {whole_parameter(0), whole_parameter(1)}, {0.6});
  const std::vector<double> values{3.0, 11.09};
  const auto solved = [&](std::vector<double> at, double pressure_kPa, double image_kPa) {
    motion.set_imaged_pressure(image_kPa);
    MotionOutcome outcome = motion.solve(0, at, pressure_kPa);
    EXPECT_TRUE(outcome.position_mm) << outcome.reason;
    return outcome.position_mm.value_or(NodeField{});
  };
  (void)solved(values, 1.2, 0.6);
  const MotionDerivatives exact = motion.derivatives(0);
  constexpr double h = 1e-4;
  for (size_t i = 0; i < values.size(); ++i) {
    std::vector<double> above = values, below = values;
    above[i] += h;
    below[i] -= h;
    EXPECT_LT(fault(solved(above, 1.2, 0.6), solved(below, 1.2, 0.6), h, exact.by_value[i]), 1e-4) << i;
  }
  EXPECT_LT(fault(solved(values, 1.2 + h, 0.6), solved(values, 1.2 - h, 0.6), h, exact.by_pressure), 1e-4);
  EXPECT_LT(fault(solved(values, 1.2, 0.6 + h), solved(values, 1.2, 0.6 - h), h, exact.by_imaged_pressure),
            1e-4);
  const NodeField image = solved(values, 0.6, 0.6);
  double farthest_mm = 0.0;
  for (size_t dof = 0; dof < image.size(); ++dof)
    farthest_mm = std::max(farthest_mm, std::abs(image[dof] - motion.mesh().reference()[dof]));
  EXPECT_LT(farthest_mm, 1e-6);
}

TEST(UnloadedFit, ARefusedTrialLeavesNothingBehind) {
  const EllipsoidShape shape{.elements = {4, 2, 1}};
  const std::vector<double> good{3.0, 11.09}, too_soft{0.001, 1.0};
  const auto after = [&](const std::vector<std::vector<double>>& trials) {
    UnloadedMotion motion(ventricle(shape, {60.0, -60.0}, {3.0, 11.09, 1.76, 10.0}),
                          {whole_parameter(0), whole_parameter(1)}, {0.6});
    for (const std::vector<double>& trial : trials)
      EXPECT_EQ(motion.solve(0, trial, 1.2).position_mm.has_value(), trial == good);
    return motion.derivatives(0);
  };
  const MotionDerivatives alone = after({good}), with_refused = after({good, too_soft, good});
  const auto apart = [](const NodeField& a, const NodeField& b) {
    double difference = 0.0, largest = 0.0;
    for (size_t i = 0; i < a.size(); ++i) {
      difference = std::max(difference, std::abs(a[i] - b[i]));
      largest = std::max(largest, std::abs(a[i]));
    }
    return difference / largest;
  };
  for (size_t i = 0; i < good.size(); ++i)
    EXPECT_LT(apart(alone.by_value[i], with_refused.by_value[i]), 1e-6) << i;
  EXPECT_LT(apart(alone.by_imaged_pressure, with_refused.by_imaged_pressure), 1e-6);
}

TEST(UnloadedFit, FindsTheStiffnessThatIgnoringTheLoadMisses) {
  const Measurement measurement = seen_from_the_image({0.5, 3.5, 5.0}, 0.3, 0.01);
  const std::vector<EstimatedParameter> C1{{6.0, 1.0, 30.0, "C1_kPa"}};
  UnloadedMotion unloaded(imaged_gel(6.0), {whole_parameter(0)}, {imaged_kPa, 0.01});
  const FitOutcome fit = fit_motion(unloaded, C1, measurement, {});
  ASSERT_TRUE(fit.converged()) << fit.reason;
  EXPECT_LT(std::abs(fit.values[0].value - true_C1_kPa), 3 * fit.values[0].se);
  EXPECT_LT(fit.values[0].se, 0.02 * true_C1_kPa);
  EXPECT_NEAR(fit.chi2 / static_cast<double>(fit.rows), 1.0, 0.1);
  ASSERT_TRUE(fit.imaged_pressure);
  EXPECT_NEAR(fit.imaged_pressure->value_kPa, imaged_kPa, 0.03);
  EXPECT_GT(fit.imaged_pressure->se_kPa, 0.0);
  EXPECT_LE(fit.imaged_pressure->se_kPa, 0.01 * (1 + 1e-9));
  const auto again =
      unloaded.inflated_again(std::vector{fit.values[0].value}, fit.imaged_pressure->value_kPa);
  ASSERT_TRUE(again);
  EXPECT_TRUE(again->back.returned(unloaded.mesh()));
  EXPECT_LT(again->cavity_unloaded_mL, again->cavity_imaged_mL - 5.0);

  ElasticMotion ignoring(imaged_gel(6.0), {whole_parameter(0)});
  const FitOutcome wrong = fit_motion(ignoring, C1, measurement, {});
  EXPECT_GT(wrong.chi2, 1.5 * fit.chi2);
  ASSERT_TRUE(wrong.converged()) << wrong.reason;
  EXPECT_GT(std::abs(wrong.values[0].value - true_C1_kPa), 10 * wrong.values[0].se);
}

/// An equilibrium that is reached and stable, but is not the image.
TEST(UnloadedFit, AnEquilibriumElsewhereIsNoReturn) {
  const ElasticModel imaged = imaged_gel(true_C1_kPa);
  const UnloadedShape shape = InverseDesign(imaged.system()).solve(imaged_kPa);
  ElasticModel unloaded = on_unloaded(imaged.system(), shape.reference_mm, {.check_stability = true});
  EXPECT_TRUE(inflate_again(unloaded, imaged.mesh(), imaged_kPa).returned(imaged.mesh()));
  const UnloadReturn elsewhere = inflate_again(unloaded, imaged.mesh(), 0.9 * imaged_kPa);
  EXPECT_TRUE(elsewhere.report.converged());
  EXPECT_NE(elsewhere.report.stable(), std::optional(false));
  EXPECT_FALSE(elsewhere.returned(imaged.mesh()));
}

/// A frame at the pressure of the image knows nothing: values move neither the image nor it.
TEST(UnloadedFit, AnOffsetOfThePressuresReachesTheImagesToo) {
  Measurement measurement = seen_from_the_image({0.5, 3.5, 5.0}, 0.1, 0.0);
  for (Frame& frame : measurement.frames)
    frame.pressure_kPa += 0.3;
  const std::vector<EstimatedParameter> C1{{6.0, 1.0, 30.0, "C1_kPa"}};
  UnloadedMotion unloaded(imaged_gel(6.0), {whole_parameter(0)}, {imaged_kPa + 0.3});
  FitOptions options;
  options.pressure_offset_sigma_kPa = 1.0;
  const FitOutcome fit = fit_motion(unloaded, C1, measurement, options);
  ASSERT_TRUE(fit.converged()) << fit.reason;
  ASSERT_TRUE(fit.pressure_offset);
  EXPECT_LT(std::abs(fit.pressure_offset->value_kPa - 0.3), 3 * fit.pressure_offset->se_kPa);
  EXPECT_LT(std::abs(fit.values[0].value - true_C1_kPa), 3 * fit.values[0].se);
}

}  // namespace
}  // namespace diastole
