// The work-energy equation: exact derivatives, the table of a loop, and what it tells that one loaded shape does not.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/fit/unloaded_motion.hpp"
#include "tests/estimator/fe/ventricle.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

const EllipsoidShape heart{.elements = {4, 2, 1}};
const std::vector<double> truth{3.0, 11.09, 1.76, 10.0};
constexpr double peak_kPa = 2.0;

ElasticModel ventricle_of(const std::vector<double>& values) {
  return ventricle(heart, {60.0, -60.0}, values);
}

std::vector<ParameterGroup> all_four() {
  return {whole_parameter(0), whole_parameter(1), whole_parameter(2), whole_parameter(3)};
}

/// Filling and emptying along the body's own curve, in a period of 1 s.
WorkLoop loop_of(ElasticModel& model, size_t count) {
  WorkLoop loop;
  ElasticState state = model.rest_state();
  for (size_t i = 0; i < count; ++i) {
    const double phase_s = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    const double pressure_kPa = peak_kPa * std::pow(std::sin(std::numbers::pi * phase_s), 2);
    state = model.solve(pressure_kPa, state).state;
    loop.points.push_back({phase_s, model.cavity_volume_mL(state), 0.0, pressure_kPa, 0.0});
  }
  return loop;
}

TEST(WorkEnergy, TheBodysOwnWorkIsWhatItStores) {
  ElasticModel model = ventricle_of(truth);
  const double stored_mJ = model.stored_energy_mJ(model.solve(peak_kPa).state);
  const MeasuredWork work = loop_of(model, 48).between(0.0, 0.5);
  EXPECT_NEAR(work.work_mJ / stored_mJ, 1.0, 0.005);  // chords
}

TEST(WorkEnergy, DerivativesOfAnUnloadedBodysAreTotalOnes) {
  constexpr double imaged_kPa = 0.5, h = 1e-3;
  UnloadedMotion motion(ventricle_of(truth), all_four(), {imaged_kPa});
  const auto stored = [&](const std::vector<double>& values, double pressure_kPa, double at_kPa) {
    motion.set_imaged_pressure(at_kPa);
    EXPECT_TRUE(motion.solve(0, values, pressure_kPa).position_mm);
    return motion.stored_energy_mJ(0);
  };
  EXPECT_NEAR(stored(truth, imaged_kPa, imaged_kPa), 0.0, 1e-6);
  (void)stored(truth, peak_kPa, imaged_kPa);
  const EnergyDerivatives exact = motion.energy_derivatives(0);
  for (size_t i = 0; i < truth.size(); ++i) {
    std::vector<double> above = truth, below = truth;
    above[i] *= 1 + h;
    below[i] *= 1 - h;
    const double difference =
        (stored(above, peak_kPa, imaged_kPa) - stored(below, peak_kPa, imaged_kPa)) / (2 * h * truth[i]);
    EXPECT_NEAR(exact.by_value[i] / difference, 1.0, 1e-3) << i;
  }
  EXPECT_NEAR((stored(truth, peak_kPa + h, imaged_kPa) - stored(truth, peak_kPa - h, imaged_kPa)) / (2 * h) /
                  exact.by_pressure,
              1.0, 1e-3);
  EXPECT_NEAR((stored(truth, peak_kPa, imaged_kPa + h) - stored(truth, peak_kPa, imaged_kPa - h)) / (2 * h) /
                  exact.by_imaged_pressure,
              1.0, 1e-3);
}

TEST(WorkEnergy, DerivativesAreTotalOnes) {
  ElasticMotion motion(ventricle_of(truth), all_four());
  const auto stored = [&](const std::vector<double>& values, double pressure_kPa) {
    EXPECT_TRUE(motion.solve(0, values, pressure_kPa).position_mm);
    return motion.stored_energy_mJ(0);
  };
  (void)stored(truth, peak_kPa);
  const EnergyDerivatives exact = motion.energy_derivatives(0);
  constexpr double h = 1e-3;
  for (size_t i = 0; i < truth.size(); ++i) {
    std::vector<double> above = truth, below = truth;
    above[i] *= 1 + h;
    below[i] *= 1 - h;
    const double difference = (stored(above, peak_kPa) - stored(below, peak_kPa)) / (2 * h * truth[i]);
    EXPECT_NEAR(exact.by_value[i] / difference, 1.0, 1e-4) << i;
  }
  EXPECT_NEAR((stored(truth, peak_kPa + h) - stored(truth, peak_kPa - h)) / (2 * h) / exact.by_pressure, 1.0,
              1e-4);
}

TEST(WorkEnergy, ErrorsOfFibresAndWallsChangeWhatIsStored) {
  ElasticModel model = ventricle_of(truth);
  const ElasticState state = model.solve(peak_kPa).state;
  std::vector<ConsideredError> errors = fibre_errors(model, 1.0);
  for (ConsideredError& error : geometry_errors(model, 0.1))
    errors.push_back(std::move(error));
  const std::vector<ConsideredMotion> motions = considered_motions(model, state, errors);
  for (size_t i = 0; i < errors.size(); ++i) {
    const auto stored = [&](double amount) {
      ElasticModel with = errors[i].with(model, amount);
      return with.stored_energy_mJ(with.solve(peak_kPa).state);
    };
    const double difference = 0.5 * (stored(errors[i].sigma) - stored(-errors[i].sigma));
    EXPECT_NEAR(motions[i].stored_energy_mJ, difference, 0.02 * std::abs(difference) + 1e-4) << i;
  }
}

TEST(WorkEnergy, WhatACycleDoesNotReturnIsHalfTakenOffAndCounts) {
  // Phases are those of the middles of 64 windows: the chord across the trigger leaves out little.
  WorkLoop loop;
  for (int i = 0; i < 64; ++i) {
    const double share = (i + 0.5) / 64, phase = 2 * std::numbers::pi * share;
    loop.points.push_back(
        {share, 5 - 5 * std::cos(phase), 0, 1 - std::cos(phase) + 0.2 * std::sin(phase), 0});
  }
  const MeasuredWork work = loop.between(0.0, 0.5);
  const double area_mJ = std::numbers::pi * 5 * 0.2;
  EXPECT_NEAR(work.work_mJ, 10.0, 0.05);  // of p = 2 V / 10
  EXPECT_NEAR(work.sigma_mJ, area_mJ / std::sqrt(12.0), 0.03 * area_mJ);
  EXPECT_NEAR(work.volume_change_mL, 10.0, 0.1);
}

TEST(WorkEnergy, ReadsWhatFlowWritesAndRefusesWhatIsNoCycle) {
  const test::ScratchFolder folder;
  const std::string heading =
      "phase_s,volume_mL,volume_sigma_mL,pressure_kPa,pressure_sigma_kPa,stiffness_kPa_per_mL,stiffness_"
      "sigma_kPa_per_mL\n";
  const auto rows = [&](int count, double second_s = 0.15) {
    std::string text = heading;
    for (int i = 0; i < count; ++i)
      text += fmt::format("{},{},0.1,{},0.01,{}\n", i == 1 ? second_s : 0.05 + 0.1 * i, i < 5 ? i : 10 - i,
                          0.1 * (i < 5 ? i : 10 - i), i % 5 == 0 ? "," : "0.1,0.01");
    return folder.write("heart.loop.csv", text);
  };
  const WorkLoop loop = read_work_loop(rows(10));
  EXPECT_NEAR(loop.period_s(), 1.0, 1e-9);
  EXPECT_EQ(loop.points.size(), 10U);
  Measurement measurement;
  measurement.frames = {{0.0, 0, 0}, {0.3, 0.3, 0.01}, {0.55, 0.5, 0.01}};
  measurement.points = {{1, {}, {}, 0.1}, {2, {}, {}, 0.1}};
  EXPECT_EQ(measured_work(loop, measurement, "heart.loop.csv").frame, 2);
  const auto refusal = [&](const auto& what) { return test::message_of(what); };
  EXPECT_THAT(refusal([&] { (void)read_work_loop(rows(5)); }), HasSubstr("5 points are no loop"));
  EXPECT_THAT(refusal([&] { (void)read_work_loop(rows(10, 0.11)); }), HasSubstr("line 3"));
  measurement.frames[2].time_s = 1.4;
  EXPECT_THAT(refusal([&] { (void)measured_work(loop, measurement, "heart.loop.csv"); }),
              HasSubstr("same trigger"));
  measurement.frames[0].time_s = 0.55;
  measurement.frames[2].time_s = 0.95;
  EXPECT_THAT(refusal([&] { (void)measured_work(loop, measurement, "heart.loop.csv"); }),
              HasSubstr("filled"));
}

/// One loaded frame of a ventricle, all pressures off by the same: a catheter's zero.
constexpr double offset_sigma_kPa = 0.01;

struct Draw {
  Measurement measurement;
  WorkLoop loop;
};

Draw drawn(const WorkLoop& exact, ElasticModel& model, const NodeField& loaded, unsigned seed) {
  constexpr double sigma_mm = 0.3, sigma_kPa = 0.01, sigma_mL = 0.15;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  const double offset_kPa = offset_sigma_kPa * normal(random);
  Draw draw{{}, exact};
  draw.measurement.frames = {{0.0, 0.0, 0.0},
                             {0.5, peak_kPa + offset_kPa + sigma_kPa * normal(random), sigma_kPa}};
  for (size_t i = 0; i < 300; ++i) {
    const MaterialPoint point{i % model.mesh().element_count(), {unit(random), unit(random), unit(random)}};
    const Eigen::Vector3d X = model.mesh().value(model.mesh().reference(), point);
    const Eigen::Vector3d x = model.mesh().value(loaded, point) +
                              sigma_mm * Eigen::Vector3d{normal(random), normal(random), normal(random)};
    draw.measurement.points.push_back({1, {X[0], X[1], X[2]}, {x[0], x[1], x[2]}, sigma_mm});
  }
  for (WorkLoop::Point& point : draw.loop.points) {
    point.volume_mL += sigma_mL * normal(random);
    point.volume_sigma_mL = sigma_mL;
    point.pressure_kPa += offset_kPa + sigma_kPa * normal(random);
    point.pressure_sigma_kPa = sigma_kPa;
  }
  return draw;
}

/// C and the exponents lie on a ridge that one loaded shape leaves; the work crosses it.
TEST(WorkEnergy, ResolvesTheRidgeOfScaleAndExponents) {
  constexpr int draws = 12, least_held = 8;  // of 95 % intervals; fewer in one of 5000 times
  ElasticModel model = ventricle_of(truth);
  const WorkLoop exact = loop_of(model, 32);
  const NodeField loaded = model.solve(peak_kPa).state.position_mm;
  const std::vector<EstimatedParameter> sought{
      {2.5, 0.05, 60.0, "C_kPa"}, {9.0, 1.0, 60.0, "b1"}, {2.5, 0.2, 20.0, "b2"}, {8.0, 0.5, 50.0, "b3"}};
  std::array<double, 2> log_se{};
  std::array<int, 4> held{};
  for (unsigned seed = 1; seed <= draws; ++seed) {
    const Draw draw = drawn(exact, model, loaded, seed);
    FitOptions options;
    options.pressure_offset_sigma_kPa = offset_sigma_kPa;
    options.robustness = Robustness::never;
    for (const bool with_work : {false, true}) {
      if (with_work) options.work = measured_work(draw.loop, draw.measurement, "loop");
      ElasticMotion motion(ventricle_of({2.5, 9.0, 2.5, 8.0}), all_four());
      const FitOutcome fit = fit_motion(motion, sought, draw.measurement, options);
      ASSERT_TRUE(fit.converged()) << seed << " " << fit.reason;
      log_se[with_work ? 1 : 0] += fit.values[0].se / fit.values[0].value / draws;
      for (size_t i = 0; with_work && i < truth.size(); ++i)
        held[i] += fit.values[i].ci95[0] < truth[i] && truth[i] < fit.values[i].ci95[1] ? 1 : 0;
    }
  }
  RecordProperty("relative_se_of_C_without", std::to_string(log_se[0]));
  RecordProperty("relative_se_of_C_with", std::to_string(log_se[1]));
  EXPECT_LT(log_se[1], 0.75 * log_se[0]) << log_se[0] << " " << log_se[1];
  for (size_t i = 0; i < truth.size(); ++i)
    EXPECT_GE(held[i], least_held) << i;
}

}  // namespace
}  // namespace diastole
