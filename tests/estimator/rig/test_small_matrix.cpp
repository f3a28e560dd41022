#include "estimator/rig/small_matrix.hpp"

#include <gtest/gtest.h>

namespace diastole::rig {
namespace {

TEST(SmallMatrix, MultipliesAsEigenDoes) {
  for (Eigen::Index rows = 1; rows <= 45; ++rows) {
    const Eigen::Index columns = 1 + (7 * rows) % 31;
    const Eigen::MatrixXd matrix = Eigen::MatrixXd::Random(rows, columns);
    const Eigen::VectorXd in = Eigen::VectorXd::Random(columns + 2);
    const Eigen::VectorXd expected = matrix * in.tail(columns);
    const SmallMatrix small(matrix);
    Eigen::VectorXd out = Eigen::VectorXd::Constant(SmallMatrix::padded(rows), 7.0);
    small.times_from(in, 2, out);
    EXPECT_LT((out.head(rows) - expected).norm(), 1e-13) << rows;
    EXPECT_EQ(out.tail(out.size() - rows).norm(), 0.0) << rows;
    const Eigen::VectorXd from_start = matrix * in.head(columns);
    small.add_times(out, in, out);
    EXPECT_LT((out.head(rows) - expected - from_start).norm(), 1e-13) << rows;
    Eigen::VectorXd beside = Eigen::VectorXd::Constant(out.size(), 7.0);
    small.add_times(out, in, beside);
    EXPECT_LT((beside.head(rows) - expected - 2.0 * from_start).norm(), 1e-13) << rows;
  }
}

}  // namespace
}  // namespace diastole::rig
