// Against a fit by hand: one unknown x that the motion says is m, with sd s, and a reading says is r, with sd 1.

#include "estimator/explain/imaging/prior_strain.hpp"

#include <gmock/gmock.h>

#include <cmath>

namespace diastole::explain {
namespace {

FieldFit fit_of(double motion, double motion_sd, double reading) {
  const double weight = 1.0 / (motion_sd * motion_sd);
  const double x = (weight * motion + reading) / (weight + 1.0);
  FieldFit fit;
  fit.jacobian = Eigen::Vector2d(1.0 / motion_sd, 1.0);
  fit.residuals = Eigen::VectorXd::Constant(1, (x - motion) / motion_sd);
  fit.priors = Eigen::VectorXd::Constant(1, x - reading);
  fit.covariance = Eigen::MatrixXd::Constant(1, 1, 1.0 / (weight + 1.0));
  return fit;
}

TEST(PriorStrain, IsTheDifferenceOfWhatTheReadingSaysAndWhatTheRestSays) {
  for (const double motion_sd : {0.1, 1.0, 20.0}) {
    SCOPED_TRACE(motion_sd);
    const PriorStrain strain = prior_strain(fit_of(7.0, motion_sd, 3.0));
    EXPECT_NEAR(strain.deleted[0], 4.0, 1e-9);
    EXPECT_NEAR(strain.off[0], 4.0 / std::hypot(1.0, motion_sd), 1e-9);
    EXPECT_NEAR(strain.chi_square, std::pow(strain.off[0], 2), 1e-9);
    EXPECT_EQ(strain.degrees, 1.0);
  }
}

TEST(PriorStrain, IsTheSameBesideAnUnknownThatNothingShows) {
  const PriorStrain alone = prior_strain(fit_of(7.0, 1.0, 3.0));
  FieldFit fit = fit_of(7.0, 1.0, 3.0);
  fit.jacobian.conservativeResizeLike(Eigen::MatrixXd::Zero(2, 2));
  estimate_covariance(fit, inference::ParameterSpace({{"x"}, {"turn"}}), {true, true});
  EXPECT_THAT(fit.undetermined, testing::ElementsAre("turn +1"));
  const PriorStrain strain = prior_strain(fit);
  EXPECT_NEAR(strain.off[0], alone.off[0], 1e-12);
  EXPECT_NEAR(strain.chi_square, alone.chi_square, 1e-12);
  EXPECT_EQ(strain.degrees, 1.0);
}

TEST(PriorStrain, IsNoneWhereOnlyTheReadingTells) {
  FieldFit fit = fit_of(7.0, 1.0, 3.0);
  fit.jacobian(0, 0) = 0.0;
  fit.covariance(0, 0) = 1.0;
  fit.priors[0] = 0.0;
  const PriorStrain strain = prior_strain(fit);
  EXPECT_EQ(strain.off[0], 0.0);
  EXPECT_EQ(strain.degrees, 0.0);
}

}  // namespace
}  // namespace diastole::explain
