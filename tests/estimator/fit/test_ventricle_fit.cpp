// Four parameters of a transversely isotropic law from noise-free displacements of an independent solver, from
// a far start: what is left is the discretisation's bias.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "estimator/fit/study_fit.hpp"
#include "estimator/io/measurement.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

TEST(VentricleFit, FindsTheLawOfAnIndependentSolver) {
  const std::filesystem::path examples = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples";
  const Study study = read_study(examples / "lv-clean.study.toml");
  const FitRecord fit = fit_study(study, read_measurement(study), {});
  ASSERT_TRUE(fit.converged) << fit.reason;
  EXPECT_EQ(fit.specimen, "ellipsoid");
  const std::map<std::string, double> truth{{"C_kPa", 3.0}, {"b1", 11.09}, {"b2", 1.76}, {"b3", 10.0}};
  ASSERT_EQ(fit.parameters.size(), truth.size());
  for (const FittedParameter& parameter : fit.parameters) {
    const double expected = truth.at(parameter.name);
    EXPECT_NEAR(parameter.value, expected, 0.015 * expected) << parameter.name;
  }
}

StudyFitOptions on_finer_mesh() {
  StudyFitOptions options;
  options.finer_mesh = true;
  return options;
}

double value_of(const FitRecord& fit, const std::string& name) {
  return std::ranges::find(fit.parameters, name, &FittedParameter::name)->value;
}

TEST(VentricleFit, AFinerMeshCorrectsACoarseOne) {
  Study study = read_study(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / "lv-clean.study.toml");
  std::get<EllipsoidSpecimen>(study.specimen).mesh = {6, 3, 1};
  const Measurement measurement = read_measurement(study);
  const FitRecord coarse = fit_study(study, measurement, {});
  const FitRecord corrected = fit_study(study, measurement, on_finer_mesh());
  ASSERT_TRUE(coarse.converged && corrected.converged) << corrected.reason;
  for (const auto& [name, truth] : std::map<std::string, double>{{"C_kPa", 3.0}, {"b1", 11.09}, {"b2", 1.76}})
    EXPECT_LT(std::abs(value_of(corrected, name) - truth), 0.25 * std::abs(value_of(coarse, name) - truth))
        << name;
  EXPECT_LT(corrected.chi2, 0.1 * coarse.chi2);
  EXPECT_LT(corrected.rms_mm, 0.4 * coarse.rms_mm) << "residuals are the corrected ones, too";
  EXPECT_THAT(corrected.remarks, testing::Contains(testing::HasSubstr("Twice as many elements")));
}

TEST(VentricleFit, AFinerMeshIsRefusedWhereItHasNoMeaning) {
  Study study = read_study(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / "lv-clean.study.toml");
  study.law.parameters.front().vary = Variation::element;
  const Measurement measurement = read_measurement(study);
  EXPECT_THROW((void)fit_study(study, measurement, on_finer_mesh()), InputError);
}

}  // namespace
}  // namespace diastole
