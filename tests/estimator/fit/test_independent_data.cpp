// Estimates from data that an independent solver made (../shared/data/fe beside the source; skipped where absent).

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include "estimator/fe/study_model.hpp"
#include "estimator/fit/study_fit.hpp"

namespace diastole {
namespace {

const std::filesystem::path data = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "../shared/data/fe";

class IndependentData : public testing::Test {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(data)) GTEST_SKIP() << "skipped: there is no " << data.string();
  }
  static FitRecord fit(const char* name, const StudyFitOptions& options = {}) {
    const Study study = read_study(data / name);
    return fit_study(study, read_measurement(study), options);
  }
};

double variation(const FittedParameter& parameter) {
  double squares = 0;
  for (const FittedElement& element : parameter.elements)
    squares += std::pow(element.value - parameter.value, 2);
  return std::sqrt(squares / static_cast<double>(parameter.elements.size() - 1)) / parameter.value;
}

TEST_F(IndependentData, TheHomogeneousGelsMapIsFlat) {
  const FitRecord record = fit("phantom-a-element.study.toml");
  ASSERT_TRUE(record.converged) << record.reason;
  EXPECT_LE(record.iterations, 7);
  const FittedParameter& C1 = record.parameters[0];
  EXPECT_NEAR(C1.value / 8.71, 1, 0.02);
  EXPECT_LT(variation(C1), 0.098);
  EXPECT_TRUE(C1.at_bound.empty());
  for (const FittedElement& element : C1.elements)
    EXPECT_LT(std::abs(element.value - 8.71), 1.96 * element.se);
}

/// C1 of phantom-b (labels.json) averaged over each element.
std::vector<double> phantom_b() {
  const ElasticModel model = make_model(read_study(data / "phantom-b-element.study.toml"));
  const HermiteMesh& mesh = model.mesh();
  std::vector<double> mean(mesh.element_count(), 0);
  constexpr int samples = 6;
  for (size_t e = 0; e < mean.size(); ++e) {
    double volume = 0;
    for (int i = 0; i < samples * samples * samples; ++i) {
      const MaterialPoint point{e,
                                {(i % samples + 0.5) / samples, (i / samples % samples + 0.5) / samples,
                                 (i / samples / samples + 0.5) / samples}};
      const Eigen::Vector3d X_mm = mesh.value(mesh.reference(), point);
      const double share = mesh.xi_gradient(mesh.reference(), point).determinant();
      const double angle = std::atan2(X_mm[1], X_mm[0]) - 40 * M_PI / 180;
      mean[e] += share * 8.7 * (1 + 0.1 * std::cos(angle) + 0.05 * X_mm[2] / 42.5);
      volume += share;
    }
    mean[e] /= volume;
  }
  return mean;
}

TEST_F(IndependentData, TheHeterogeneousGelsMapIsFound) {
  const FitRecord record = fit("phantom-b-element.study.toml");
  ASSERT_TRUE(record.converged) << record.reason;
  EXPECT_LE(record.iterations, 7);
  const FittedParameter& C1 = record.parameters[0];
  const std::vector<double> truth = phantom_b();
  ASSERT_EQ(C1.elements.size(), truth.size());
  Eigen::ArrayXd found(32), true_map(32);
  int inside = 0;
  for (size_t e = 0; e < truth.size(); ++e) {
    found[static_cast<Eigen::Index>(e)] = C1.elements[e].value;
    true_map[static_cast<Eigen::Index>(e)] = truth[e];
    inside += C1.elements[e].ci95[0] <= truth[e] && truth[e] <= C1.elements[e].ci95[1] ? 1 : 0;
  }
  const double rms = std::sqrt((found / true_map - 1).square().mean());
  const Eigen::ArrayXd a = found - found.mean(), b = true_map - true_map.mean();
  const double correlation = (a * b).sum() / std::sqrt(a.square().sum() * b.square().sum());
  EXPECT_GE(correlation, 0.9);
  EXPECT_LE(rms, 0.05);
  EXPECT_GE(inside, 29);
  RecordProperty("correlation", fmt::format("{:.3f}", correlation));
  RecordProperty("rms", fmt::format("{:.4f}", rms));
}

TEST_F(IndependentData, TheVentriclesLawIsInsideItsIntervals) {
  const FitRecord record = fit("lv-a.study.toml");
  ASSERT_TRUE(record.converged) << record.reason;
  const std::map<std::string, double> truth{{"C_kPa", 3.0}, {"b1", 11.09}, {"b2", 1.76}, {"b3", 10.0}};
  for (const FittedParameter& parameter : record.parameters) {
    EXPECT_LE(parameter.ci95[0], truth.at(parameter.name)) << parameter.name;
    EXPECT_GE(parameter.ci95[1], truth.at(parameter.name)) << parameter.name;
  }
  ASSERT_EQ(record.directions.size(), 4U);
  EXPECT_GT(record.directions.front().relative_sd, record.directions.back().relative_sd);
  EXPECT_THAT(record.remarks, testing::Contains(testing::HasSubstr("b2 and b3 trade off")));
}

TEST_F(IndependentData, FivePerCentOfWildPointsKeepTheGelsStiffness) {
  const Study study = read_study(data / "phantom-a.study.toml");
  const Measurement sound = read_measurement(study);
  // 1.6 % below the truth, by the errors of the measured pressures.
  const double sound_kPa = fit_study(study, sound, {}).parameters[0].value;
  for (unsigned draw = 1; draw <= 10; ++draw) {
    const double most_mm = 5.0 * (1 << draw % 4);  // 5, 10, 20, 40
    SCOPED_TRACE(testing::Message() << "draw " << draw << ", thrown up to " << most_mm
                                    << " mm along each axis");
    Measurement measurement = sound;
    std::mt19937 generator(draw);
    std::uniform_real_distribution<double> chance(0, 1), throw_mm(-most_mm, most_mm);
    for (TagPoint& tag : measurement.tags) {
      if (chance(generator) > 0.05) continue;
      for (double& x_mm : tag.x_mm)
        x_mm += throw_mm(generator);
    }
    const FitRecord record = fit_study(study, measurement, {});
    ASSERT_TRUE(record.converged) << record.reason;
    EXPECT_NEAR(record.parameters[0].value / sound_kPa, 1, 0.02);
    EXPECT_NEAR(record.parameters[0].value, 8.71, 3 * record.parameters[0].se);
    ASSERT_TRUE(record.robust);
    EXPECT_THAT(record.remarks, testing::Contains(testing::HasSubstr("wild residuals")));
  }
}

}  // namespace
}  // namespace diastole
