#include "estimator/imaging/tracking/brightness.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <type_traits>

namespace diastole::imaging {
namespace {

/// The slice's own average counts like a hundredth of a full window: nothing beside one, all in an empty one.
constexpr double share_of_window = 0.01;
constexpr double nodes_per_window = 2.0;

/// `act(count)` with the number of patterns as a constant.
template <class Act>
void with_count(int patterns, const Act& act) {
  switch (patterns) {
    case 1:
      return act(std::integral_constant<int, 1>());  // a constant
    case 3:
      return act(std::integral_constant<int, 3>());  // tags of one direction
    case 4:
      return act(std::integral_constant<int, 4>());  // or of two
    case 5:
      return act(std::integral_constant<int, 5>());  // a constant, and cosine and sine of two
    default:
      throw std::logic_error("brightness of so many patterns");
  }
}

}  // namespace

Brightness::Brightness(const Eigen::Vector2d& extent_mm, double window_mm, int patterns)
    : patterns_(patterns),
      node_mm_(window_mm / nodes_per_window),
      columns_(static_cast<Eigen::Index>(extent_mm.x() / node_mm_) + 3),
      rows_(static_cast<Eigen::Index>(extent_mm.y() / node_mm_) + 3) {
  moments_.setZero(patterns * (patterns + 1) / 2 + patterns, columns_ * rows_);
  is_added_.assign(static_cast<size_t>(columns_ * rows_), false);
  amplitudes_.setZero(patterns, columns_ * rows_);
}

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
  with_count(patterns_, [&](auto count) { add_pixel<count>(x_mm, patterns.data(), weight, value); });
}

void Brightness::solve(Places places) {
  with_count(patterns_, [&](auto count) { solve_nodes<count>(places); });
}

template <int Count>
void Brightness::add_pixel(const Eigen::Vector2d& x_mm, const double* patterns, double weight, double value) {
  constexpr Eigen::Index length = Count * (Count + 1) / 2 + Count;
  Eigen::Array<double, length, 1> moments;
  Eigen::Index at = 0;
  for (int i = 0; i < Count; ++i) {
    for (int j = 0; j <= i; ++j)
      moments[at++] = weight * patterns[i] * patterns[j];
  }
  for (int i = 0; i < Count; ++i)
    moments[at++] = weight * patterns[i] * value;
  const Corner here = corner(x_mm);
  for (size_t i = 0; i < 4; ++i) {
    Eigen::Map<Eigen::Array<double, length, 1>>(moments_.col(here.node[i]).data()) += here.share[i] * moments;
    is_added_[static_cast<size_t>(here.node[i])] = true;
  }
}

template <int Count>
void Brightness::solve_nodes(Places places) {
  constexpr Eigen::Index length = Count * (Count + 1) / 2 + Count;
  using Moments = Eigen::Array<double, length, Eigen::Dynamic>;
  // Nodes are half a window apart, and bilinear shares have spread each pixel by some of that already.
  const double sigma = std::sqrt(nodes_per_window * nodes_per_window - 1.0 / 6.0);
  const auto reach = static_cast<Eigen::Index>(std::ceil(3 * sigma));
  std::vector<double> bell;
  for (Eigen::Index i = -reach; i <= reach; ++i)
    bell.push_back(std::exp(-0.5 * static_cast<double>(i * i) / (sigma * sigma)));
  const double nodes_in_window = 2 * std::numbers::pi * sigma * sigma;
  const Eigen::Map<const Moments> moments(moments_.data(), length, moments_.cols());
  const Eigen::Array<double, length, 1> all = share_of_window * nodes_in_window * moments.rowwise().mean();
  const auto is_added = [&](Eigen::Index row, Eigen::Index column) {
    return is_added_[static_cast<size_t>(row * columns_ + column)];
  };
  // Where there are pixels: rows of nodes, from the first column to before the last.
  Eigen::Index top = rows_, bottom = 0, left = columns_, right = 0;
  for (Eigen::Index row = 0; row < rows_; ++row) {
    for (Eigen::Index column = 0; column < columns_; ++column) {
      if (!is_added(row, column)) continue;
      top = std::min(top, row);
      bottom = row + 1;
      left = std::min(left, column);
      right = std::max(right, column + 1);
    }
  }
  const bool everywhere = places == Places::all;
  const Eigen::Index first = everywhere ? 0 : left, last = everywhere ? columns_ : right;
  if (first >= last) return;
  // Whole rows of nodes at once, shifted against each other.
  Moments along_rows = Moments::Zero(length, columns_ * rows_);
  for (Eigen::Index row = top; row < bottom; ++row) {
    for (Eigen::Index i = -reach; i <= reach; ++i) {
      const Eigen::Index from = std::max(first, left - i), to = std::min(last, right - i);
      if (from < to)
        along_rows.middleCols(row * columns_ + from, to - from) +=
            bell[static_cast<size_t>(i + reach)] * moments.middleCols(row * columns_ + from + i, to - from);
    }
  }
  Eigen::Matrix<double, Count, Count> matrix;
  Moments sums(length, last - first);
  for (Eigen::Index row = everywhere ? 0 : top; row < (everywhere ? rows_ : bottom); ++row) {
    sums.colwise() = all;
    for (Eigen::Index i = std::max(-reach, top - row); i <= std::min(reach, bottom - 1 - row); ++i)
      sums += bell[static_cast<size_t>(i + reach)] *
              along_rows.middleCols((row + i) * columns_ + first, last - first);
    for (Eigen::Index column = first; column < last; ++column) {
      if (!everywhere && !is_added(row, column)) continue;
      const Eigen::Array<double, length, 1> here = sums.col(column - first);
      Eigen::Index at = 0;
      for (int i = 0; i < Count; ++i) {
        for (int j = 0; j <= i; ++j)
          matrix(i, j) = matrix(j, i) = here[at++];
      }
      matrix.diagonal().array() += 1e-9 * matrix.trace() + 1e-300;
      amplitudes_.col(row * columns_ + column) = Eigen::LDLT<Eigen::Matrix<double, Count, Count>>(matrix)
                                                     .solve(here.template tail<Count>().matrix())
                                                     .array();
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

double Brightness::picture(const Eigen::Vector2d& x_mm, std::span<const double> patterns,
                           std::span<double> amplitudes) const {
  at(x_mm, amplitudes.first(patterns.size()));
  double sum = 0;
  for (size_t j = 0; j < patterns.size(); ++j)
    sum += amplitudes[j] * patterns[j];
  return sum;
}

}  // namespace diastole::imaging
