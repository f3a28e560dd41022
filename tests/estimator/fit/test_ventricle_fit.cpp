// Four parameters of a transversely isotropic law from noise-free displacements of an independent solver, from
// a far start: what is left is the discretisation's bias.

#include <gtest/gtest.h>

#include <filesystem>
#include <map>

#include "estimator/fit/study_fit.hpp"
#include "estimator/io/measurement.hpp"

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

}  // namespace
}  // namespace diastole
