#include "estimator/imaging/tracking/brightness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace diastole::imaging {
namespace {

/// The slice's own average counts like a hundredth of a full window: nothing beside one, all in an empty one.
constexpr double share_of_window = 0.01;
constexpr double nodes_per_window = 2.0;
/// A constant, and cosine and sine of two directions.
constexpr int most_patterns = 5;

}  // namespace

Brightness::Brightness(const Eigen::Vector2d& extent_mm, double window_mm, int patterns)
    : patterns_(patterns),
      node_mm_(window_mm / nodes_per_window),
      columns_(static_cast<Eigen::Index>(extent_mm.x() / node_mm_) + 3),
      rows_(static_cast<Eigen::Index>(extent_mm.y() / node_mm_) + 3) {
  moments_.resize(patterns * (patterns + 1) / 2 + patterns, columns_ * rows_);
  amplitudes_.setZero(patterns, columns_ * rows_);
  clear();
}

void Brightness::clear() { moments_.setZero(); }

Brightness::Corner Brightness::corner(const Eigen::Vector2d& x_mm) const {
  const double across = std::clamp(x_mm.x() / node_mm_, 0.0, static_cast<double>(columns_) - 1.001);
  const double down = std::clamp(x_mm.y() / node_mm_, 0.0, static_cast<double>(rows_) - 1.001);
  const auto column = static_cast<Eigen::Index>(across);
  const auto row = static_cast<Eigen::Index>(down);
  const double u = across - static_cast<double>(column);
  const double v = down - static_cast<double>(row);
  const Eigen::Index first = row * columns_ + column;
  return {{first, first + 1, first + columns_, first + columns_ + 1},
          {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v}};
}

void Brightness::add(const Eigen::Vector2d& x_mm, std::span<const double> patterns, double weight,
                     double value) {
  std::array<double, 32> moments{};
  size_t at = 0;
  for (size_t i = 0; i < patterns.size(); ++i) {
    for (size_t j = 0; j <= i; ++j)
      moments[at++] = weight * patterns[i] * patterns[j];
  }
  for (const double pattern : patterns)
    moments[at++] = weight * pattern * value;
  const Corner here = corner(x_mm);
  const Eigen::Map<const Eigen::ArrayXd> all(moments.data(), moments_.rows());
  for (size_t i = 0; i < 4; ++i)
    moments_.col(here.node[i]) += here.share[i] * all;
}

void Brightness::solve() {
  // Nodes are half a window apart, and bilinear shares have spread each pixel by some of that already.
  const double sigma = std::sqrt(nodes_per_window * nodes_per_window - 1.0 / 6.0);
  const auto reach = static_cast<Eigen::Index>(std::ceil(3 * sigma));
  std::vector<double> bell;
  for (Eigen::Index i = -reach; i <= reach; ++i)
    bell.push_back(std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma)));
  const double nodes_in_window = 2 * std::numbers::pi * sigma * sigma;
  const Eigen::ArrayXd all = share_of_window * nodes_in_window * moments_.rowwise().mean();
  // Whole rows of nodes at once, shifted against each other.
  Eigen::ArrayXXd along_rows = Eigen::ArrayXXd::Zero(moments_.rows(), moments_.cols());
  for (Eigen::Index row = 0; row < rows_; ++row) {
    for (Eigen::Index i = -reach; i <= reach; ++i) {
      const Eigen::Index length = columns_ - std::abs(i);
      if (length <= 0) continue;
      along_rows.middleCols(row * columns_ + std::max<Eigen::Index>(0, -i), length) +=
          bell[static_cast<size_t>(i + reach)] *
          moments_.middleCols(row * columns_ + std::max<Eigen::Index>(0, i), length);
    }
  }
  using Small = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, most_patterns, most_patterns>;
  Small matrix(patterns_, patterns_);
  Eigen::ArrayXXd sums(moments_.rows(), columns_);
  for (Eigen::Index row = 0; row < rows_; ++row) {
    sums.colwise() = all;
    for (Eigen::Index i = std::max(-reach, -row); i <= std::min(reach, rows_ - 1 - row); ++i)
      sums += bell[static_cast<size_t>(i + reach)] * along_rows.middleCols((row + i) * columns_, columns_);
    for (Eigen::Index column = 0; column < columns_; ++column) {
      Eigen::Index at = 0;
      for (int i = 0; i < patterns_; ++i) {
        for (int j = 0; j <= i; ++j)
          matrix(i, j) = matrix(j, i) = sums(at++, column);
      }
      matrix.diagonal().array() += 1e-9 * matrix.trace() + 1e-300;
      amplitudes_.col(row * columns_ + column) =
          Eigen::LDLT<Small>(matrix).solve(sums.col(column).tail(patterns_).matrix()).array();
    }
  }
}

void Brightness::at(const Eigen::Vector2d& x_mm, std::span<double> amplitudes) const {
  const Corner here = corner(x_mm);
  for (size_t j = 0; j < amplitudes.size(); ++j) {
    amplitudes[j] = 0;
    for (size_t i = 0; i < 4; ++i)
      amplitudes[j] += here.share[i] * amplitudes_(static_cast<Eigen::Index>(j), here.node[i]);
  }
}

}  // namespace diastole::imaging
