#include "estimator/imaging/tracking/spline_plane.hpp"

#include <cmath>

namespace diastole::imaging {
namespace {

/// The four uniform cubic B-splines over a cell, at 0 <= t < 1.
std::array<double, 4> cubic(double t) {
  const double u = 1 - t;
  return {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6,
          t * t * t / 6};
}

}  // namespace

SplinePlane::SplinePlane(const Eigen::Matrix2Xd& samples_mm, double spacing_mm) : spacing_mm_(spacing_mm) {
  first_mm_ = samples_mm.rowwise().minCoeff().array() - 0.5 * spacing_mm;
  const Eigen::Vector2d last_mm = samples_mm.rowwise().maxCoeff().array() + 0.5 * spacing_mm;
  columns_ = static_cast<int>(std::floor((last_mm - first_mm_).x() / spacing_mm)) + 4;
  rows_ = static_cast<int>(std::floor((last_mm - first_mm_).y() / spacing_mm)) + 4;
  numbers_.assign(static_cast<size_t>(columns_) * static_cast<size_t>(rows_), -1);
  for (Eigen::Index i = 0; i < samples_mm.cols(); ++i) {
    const Eigen::Vector2d cell = (samples_mm.col(i) - first_mm_) / spacing_mm;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column)
        numbers_[static_cast<size_t>((static_cast<int>(cell.y()) + row) * columns_ +
                                     static_cast<int>(cell.x()) + column)] = 0;
    }
  }
  for (int& number : numbers_) {
    if (number == 0) number = count_++;
  }
}

int SplinePlane::number(int column, int row) const {
  if (column < 0 || column >= columns_ || row < 0 || row >= rows_) return -1;
  return numbers_[static_cast<size_t>(row * columns_ + column)];
}

SplineValues SplinePlane::at(const Eigen::Vector2d& x_mm) const {
  const Eigen::Vector2d cell = (x_mm - first_mm_) / spacing_mm_;
  const int column = static_cast<int>(std::floor(cell.x()));
  const int row = static_cast<int>(std::floor(cell.y()));
  SplineValues values{{}, cubic(cell.x() - column), cubic(cell.y() - row)};
  for (size_t i = 0; i < 16; ++i)
    values.index[i] = number(column + static_cast<int>(i % 4), row + static_cast<int>(i / 4));
  return values;
}

double spline_sum(const SplineValues& splines, const Eigen::Ref<const Eigen::VectorXd>& coefficients) {
  double sum = 0;
  for (size_t down = 0; down < 4; ++down) {
    double row = 0;
    for (size_t across = 0; across < 4; ++across) {
      const int index = splines.index[4 * down + across];
      if (index >= 0) row += splines.across[across] * coefficients[index];
    }
    sum += splines.down[down] * row;
  }
  return sum;
}

double SplinePlane::value(const Eigen::Ref<const Eigen::VectorXd>& coefficients,
                          const Eigen::Vector2d& x_mm) const {
  return spline_sum(at(x_mm), coefficients);
}

std::optional<std::array<int, 16>> SplinePlane::cell(int column, int row) const {
  std::array<int, 16> index{};
  for (size_t i = 0; i < 16; ++i) {
    index[i] = number(column + static_cast<int>(i % 4), row + static_cast<int>(i / 4));
    if (index[i] < 0) return std::nullopt;
  }
  return index;
}

Eigen::MatrixXd SplinePlane::precision(double kappa_per_mm) const {
  const double scale = kappa_per_mm * spacing_mm_;
  Eigen::MatrixXd operated = Eigen::MatrixXd::Zero(count_, count_);
  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const int here = number(column, row);
      if (here < 0) continue;
      operated(here, here) += scale * scale;
      for (const int next : {number(column + 1, row), number(column, row + 1)}) {
        if (next < 0) continue;
        operated(here, here) += 1;
        operated(next, next) += 1;
        operated(here, next) -= 1;
        operated(next, here) -= 1;
      }
    }
  }
  const Eigen::MatrixXd energy = operated * operated;
  const Eigen::MatrixXd covariance = energy.llt().solve(Eigen::MatrixXd::Identity(count_, count_));
  const auto weights = cubic(0.5);
  std::array<double, 16> middle{};
  for (size_t i = 0; i < 16; ++i)
    middle[i] = weights[i % 4] * weights[i / 4];
  double variance = 0;
  int cells = 0;
  each_cell([&](const std::array<int, 16>& index) {
    for (size_t i = 0; i < 16; ++i) {
      for (size_t j = 0; j < 16; ++j)
        variance += middle[i] * middle[j] * covariance(index[i], index[j]);
    }
    ++cells;
  });
  return energy * (variance / std::max(cells, 1));
}

}  // namespace diastole::imaging
