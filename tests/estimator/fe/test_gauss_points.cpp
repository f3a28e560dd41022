#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "estimator/fe/gauss_contraction.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/fe/stiffness_contraction.hpp"

namespace diastole {
namespace {

template <size_t Count>
double integral_of_power(const LineRule<Count>& rule, int power) {
  double sum = 0.0;
  for (size_t q = 0; q < Count; ++q)
    sum += rule.weight[q] * std::pow(rule.place[q], power);
  return sum;
}

TEST(GaussPoints, IntegratePolynomialsOfTheirDegreeExactly) {
  for (int power = 0; power <= 7; ++power)
    EXPECT_NEAR(integral_of_power(line_rule_4(), power), 1.0 / (power + 1), 1e-15);
  EXPECT_GT(std::abs(integral_of_power(line_rule_4(), 8) - 1.0 / 9.0), 1e-7);
  for (int power = 0; power <= 9; ++power)
    EXPECT_NEAR(integral_of_power(line_rule_5(), power), 1.0 / (power + 1), 1e-15);
  EXPECT_GT(std::abs(integral_of_power(line_rule_5(), 10) - 1.0 / 11.0), 1e-9);
}

TEST(GaussContraction, EqualsTheDirectSums) {
  const ElementField field = ElementField::Random();
  const GaussMatrices gradients = gradients_at_points(field);
  ElementField force = ElementField::Zero();
  for (size_t q = 0; q < gauss_points; ++q) {
    Eigen::Matrix3d direct;
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Map<const Eigen::Vector<double, 64>> slope(gauss_tables().slope[q][k].data());
      direct.col(static_cast<Eigen::Index>(k)) = field * slope;
      force += gradients.at(q).col(static_cast<Eigen::Index>(k)) * slope.transpose();
    }
    EXPECT_LT((gradients.at(q) - direct).norm(), 1e-13 * direct.norm());
  }
  EXPECT_LT((force_of(gradients) - force).norm(), 1e-13 * force.norm());
}

TEST(StiffnessContraction, EqualsTheDirectSumOverGaussPoints) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  StiffnessContraction contraction;
  for (size_t q = 0; q < gauss_points; ++q) {
    double* moduli_here = contraction.moduli_at(q);
    for (size_t row = 0; row < 9; ++row) {
      for (size_t column = 0; column <= row; ++column) {
        const double value = unit(random);
        moduli_here[modulus_index(row / 3, row % 3, column / 3, column % 3)] = value;
        moduli_here[modulus_index(column / 3, column % 3, row / 3, row % 3)] = value;
      }
    }
  }
  contraction.contract();
  const auto& slope = gauss_tables().slope;
  for (int trial = 0; trial < 500; ++trial) {
    size_t a = random() % hermite_functions;
    size_t b = random() % hermite_functions;
    if (a / 16 > b / 16) std::swap(a, b);
    const size_t i = random() % 3;
    const size_t k = random() % 3;
    double direct = 0.0;
    for (size_t q = 0; q < gauss_points; ++q) {
      for (size_t dk = 0; dk < 3; ++dk) {
        for (size_t dl = 0; dl < 3; ++dl) {
          direct += slope[q][dk][a] * contraction.moduli_at(q)[modulus_index(i, dk, k, dl)] * slope[q][dl][b];
        }
      }
    }
    EXPECT_NEAR(contraction.entry(a, i, b, k), direct, 1e-12 * std::max(1.0, std::abs(direct)));
  }
}

}  // namespace
}  // namespace diastole
