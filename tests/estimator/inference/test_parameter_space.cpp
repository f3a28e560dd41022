#include "estimator/inference/intervals.hpp"
#include "estimator/inference/parameter_space.hpp"

namespace diastole::inference {
namespace {

ParameterSpace three_scales() {
  return ParameterSpace({{"offset", "kPa", -2, 2, Scale::linear},
                         {"C1", "kPa", 1, 15, Scale::logarithmic},
                         {"wave_speed", "m/s", 20, 1000, Scale::inverse_square}});
}

TEST(ParameterSpace, CoordinatesAndValuesAreInverse) {
  const ParameterSpace space = three_scales();
  const std::vector<double> values{0.5, 6.0, 250.0};
  const std::vector<double> back = space.values(space.coordinates(values));
  for (size_t i = 0; i < values.size(); ++i)
    EXPECT_NEAR(back[i], values[i], 1e-12 * values[i]);
}

TEST(ParameterSpace, SlopesAreDerivatives) {
  const ParameterSpace space = three_scales();
  const Eigen::VectorXd q = space.coordinates({0.5, 6.0, 250.0});
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const double h = 1e-6 * std::abs(q[i]);
    const double slope = (space[i].value(q[i] + h) - space[i].value(q[i] - h)) / (2 * h);
    EXPECT_NEAR(space[i].slope(q[i]), slope, 1e-6 * std::abs(slope));
  }
}

TEST(ParameterSpace, BoundsOfAFallingCoordinateChangePlaces) {
  const ParameterSpace space = three_scales();
  EXPECT_DOUBLE_EQ(space.lower()[2], 0.01);
  EXPECT_DOUBLE_EQ(space.upper()[2], 25.0);
  EXPECT_EQ(space.bound_under(space.coordinates({0, 6, 1000}), 2), BoundSide::lower);
}

TEST(ParameterSpace, NamesTheBoundUnderAnUnknown) {
  const ParameterSpace space = three_scales();
  const Eigen::VectorXd q = space.coordinates({5, 1, 250});
  EXPECT_DOUBLE_EQ(q[0], 2.0);  // clamped
  EXPECT_EQ(space.bound_under(q, 0), BoundSide::upper);
  EXPECT_EQ(space.bound_under(q, 1), BoundSide::lower);
  EXPECT_EQ(space.bound_under(q, 2), BoundSide::none);
  EXPECT_EQ(space.free_unknowns(q), (std::vector{false, false, true}));
}

TEST(ParameterSpace, AnUnboundedUnknownRestsNowhere) {
  const ParameterSpace space({{"pressure"}});
  EXPECT_EQ(space.bound_under(Eigen::VectorXd::Constant(1, 1e300), 0), BoundSide::none);
}

TEST(Intervals, AreSymmetricInTheCoordinate) {
  const ParameterSpace space = three_scales();
  const auto [low, high] = interval(space[1], std::log(6.0), 0.1);
  EXPECT_NEAR(low * high, 36.0, 1e-12);
  const auto [slow, fast] = interval(space[2], 0.16, 0.05);
  EXPECT_LT(slow, 250.0);
  EXPECT_GT(fast, 250.0);
  EXPECT_NEAR(standard_error(space[2], 0.16, 0.016), 12.5, 1e-9);
}

TEST(Intervals, StudentsQuantilesAreThoseOfTheTable) {
  EXPECT_NEAR(student_quantile(1, 0.05), 12.7062, 1e-4);
  EXPECT_NEAR(student_quantile(10, 0.05), 2.2281, 1e-4);
  EXPECT_NEAR(student_quantile(59, 0.05), 2.0010, 1e-4);
}

}  // namespace
}  // namespace diastole::inference
