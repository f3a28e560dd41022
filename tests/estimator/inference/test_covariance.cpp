#include "estimator/inference/information.hpp"

namespace diastole::inference {
namespace {

Eigen::MatrixXd some_columns(Eigen::Index rows, Eigen::Index columns) {
  Eigen::MatrixXd result(rows, columns);
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < columns; ++j)
      result(i, j) = std::sin(static_cast<double>(1 + i * (j + 2)) + static_cast<double>(j));
  }
  return result;
}

TEST(Covariance, OfAStraightLine) {
  Eigen::MatrixXd line(5, 2);
  line << 1, -2, 1, -1, 1, 0, 1, 1, 1, 2;
  const Covariance found = estimate_covariance(line);
  EXPECT_TRUE(found.undetermined.empty());
  EXPECT_NEAR(found.matrix(0, 0), 1.0 / 5, 1e-14);
  EXPECT_NEAR(found.matrix(1, 1), 1.0 / 10, 1e-14);
  EXPECT_NEAR(found.matrix(0, 1), 0.0, 1e-14);
}

TEST(Covariance, DoesNotMindUnits) {
  Eigen::MatrixXd columns = some_columns(20, 3);
  const Eigen::MatrixXd normal = columns.transpose() * columns;
  const Eigen::Vector3d units(1e-9, 1, 1e9);
  const Covariance found = estimate_covariance(columns * units.asDiagonal());
  EXPECT_TRUE(found.undetermined.empty());
  const Eigen::MatrixXd back = units.asDiagonal() * found.matrix * units.asDiagonal();
  EXPECT_LT((back * normal - Eigen::Matrix3d::Identity()).norm(), 1e-9);
}

TEST(Covariance, NamesTheCombinationThatTheDataDoNotDetermine) {
  const ParameterSpace space({{"C1", "kPa", 1, 20, Scale::logarithmic},
                              {"C2", "kPa", 1, 20, Scale::logarithmic},
                              {"offset", "kPa"}});
  Eigen::MatrixXd columns = some_columns(20, 3);
  columns.col(1) = 2 * columns.col(0);  // only C1 C2^2 is seen
  const Covariance found = estimate_covariance(columns);
  ASSERT_EQ(found.undetermined.size(), 1U);
  EXPECT_EQ(in_words(found.undetermined[0], space), "ln C1 +1, ln C2 -0.5");
  EXPECT_TRUE(std::isinf(found.matrix(0, 0)));
  EXPECT_TRUE(std::isinf(found.matrix(1, 1)));
  // The offset is as well known as if C1 alone were sought.
  Eigen::MatrixXd two(20, 2);
  two << columns.col(0), columns.col(2);
  EXPECT_NEAR(found.matrix(2, 2), estimate_covariance(two).matrix(1, 1), 1e-12);
  EXPECT_EQ(found.matrix(0, 2), 0.0);
  EXPECT_EQ(correlation(found.matrix)(0, 1), 0.0);
}

TEST(Covariance, OfAnUnknownThatIsNotSeen) {
  Eigen::MatrixXd columns = some_columns(10, 2);
  columns.col(0).setZero();
  const Covariance found = estimate_covariance(columns);
  EXPECT_TRUE(std::isinf(found.matrix(0, 0)));
  EXPECT_NEAR(found.matrix(1, 1), 1 / columns.col(1).squaredNorm(), 1e-14);
  ASSERT_EQ(found.undetermined.size(), 1U);
  EXPECT_EQ(found.undetermined[0], Eigen::Vector2d(1, 0));
}

TEST(Covariance, OfFewerRowsThanUnknowns) {
  const Covariance found = estimate_covariance(some_columns(2, 3));
  EXPECT_EQ(found.undetermined.size(), 1U);
}

TEST(Covariance, LeavesOutWhatIsNotFree) {
  const Eigen::MatrixXd columns = some_columns(10, 2);
  const Covariance found = estimate_covariance(columns, {false, true});
  EXPECT_EQ(found.matrix(0, 0), 0.0);
  EXPECT_NEAR(found.matrix(1, 1), 1 / columns.col(1).squaredNorm(), 1e-14);
  EXPECT_EQ(estimate_covariance(columns, {false, false}).matrix, Eigen::Matrix2d::Zero());
}

TEST(Covariance, OfInformationIsThatOfItsJacobian) {
  const Eigen::Vector3d units(1e-4, 1, 1e4);
  const Eigen::MatrixXd columns = some_columns(20, 3) * units.asDiagonal();
  const Covariance found = covariance_of_information(columns.transpose() * columns);
  EXPECT_TRUE(found.undetermined.empty());
  EXPECT_TRUE(found.matrix.isApprox(estimate_covariance(columns).matrix, 1e-9));
  EXPECT_TRUE(information_of_covariance(found.matrix).isApprox(columns.transpose() * columns, 1e-9));
}

TEST(Covariance, OfInformationThatLacksACombination) {
  Eigen::MatrixXd columns = some_columns(20, 3);
  columns.col(1) = 2 * columns.col(0);
  const Covariance found = covariance_of_information(columns.transpose() * columns);
  ASSERT_EQ(found.undetermined.size(), 1U);
  EXPECT_LT((found.undetermined[0] - Eigen::Vector3d(1, -0.5, 0)).norm(), 1e-6);
  EXPECT_TRUE(std::isinf(found.matrix(0, 0)));
  EXPECT_TRUE(std::isinf(found.matrix(1, 1)));
  EXPECT_NEAR(found.matrix(2, 2), estimate_covariance(columns).matrix(2, 2), 1e-9);
  // Nothing is known of the two by themselves.
  const Eigen::MatrixXd information = information_of_covariance(found.matrix);
  EXPECT_EQ(information.topLeftCorner(2, 3), Eigen::MatrixXd::Zero(2, 3));
  EXPECT_NEAR(information(2, 2), 1 / found.matrix(2, 2), 1e-9);
}

TEST(Covariance, CountsWhatTheDataDetermine) {
  // The prior of the second unknown is as good as its data.
  Eigen::MatrixXd all(3, 2);
  all << 1, 0, 0, 1, 0, 1;
  EXPECT_NEAR(effective_count(estimate_covariance(all).matrix, all.topRows(2)), 1.5, 1e-14);
}

}  // namespace
}  // namespace diastole::inference
