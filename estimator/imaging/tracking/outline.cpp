#include "estimator/imaging/tracking/outline.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace diastole::imaging {
namespace {

/// Pixels make steps of a slanting edge; over three of them they are gone.
constexpr double smoothed_px = 3.0;
constexpr double apart_px = 3.0;

using Curve = std::vector<Eigen::Vector2d>;
/// An edge of the grid of pixel centres: of (column, row), to its right neighbour or to the one below.
struct GridEdge {
  Eigen::Index column, row;
  bool downwards;
  auto operator<=>(const GridEdge&) const = default;
};

/// Marching squares on a map with a border of pixels that are outside.
class EdgeWalk {
 public:
  explicit EdgeWalk(const Eigen::ArrayXXf& depth) : depth_(depth) {
    for (Eigen::Index row = -1; row < depth.rows(); ++row) {
      for (Eigen::Index column = -1; column < depth.cols(); ++column)
        join_in(column, row);
    }
  }

  std::vector<Curve> curves() {
    std::vector<Curve> all;
    while (!next_.empty()) {
      Curve curve;
      for (auto at = next_.begin(); at != next_.end();) {
        curve.push_back(place(at->first));
        const GridEdge to = at->second;
        next_.erase(at);
        at = next_.find(to);
      }
      all.push_back(std::move(curve));
    }
    return all;
  }

 private:
  [[nodiscard]] double value(Eigen::Index column, Eigen::Index row) const {
    if (column < 0 || row < 0 || column >= depth_.cols() || row >= depth_.rows()) return -0.5;
    return static_cast<double>(depth_(row, column));
  }

  [[nodiscard]] Eigen::Vector2d place(const GridEdge& edge) const {
    const double here = value(edge.column, edge.row);
    const double there = edge.downwards ? value(edge.column, edge.row + 1) : value(edge.column + 1, edge.row);
    const double share = here / (here - there);
    return {static_cast<double>(edge.column) + (edge.downwards ? 0 : share),
            static_cast<double>(edge.row) + (edge.downwards ? share : 0)};
  }

  /// The pieces of curve within a cell, tissue on their left; where corners across are alike they stay apart.
  void join_in(Eigen::Index column, Eigen::Index row) {
    const GridEdge top{column, row, false}, left{column, row, true};
    const GridEdge bottom{column, row + 1, false}, right{column + 1, row, true};
    const bool a = value(column, row) > 0, b = value(column + 1, row) > 0;
    const bool c = value(column + 1, row + 1) > 0, d = value(column, row + 1) > 0;
    // Clockwise around the cell, an edge from tissue to outside is where a piece begins, the next change before it where it ends.
    const std::pair<GridEdge, std::pair<bool, bool>> sides[] = {
        {top, {a, b}}, {right, {b, c}}, {bottom, {c, d}}, {left, {d, a}}};
    for (size_t i = 0; i < 4; ++i) {
      if (!sides[i].second.first || sides[i].second.second) continue;
      for (size_t back = 1; back < 4; ++back) {
        const auto& [edge, corners] = sides[(i + 4 - back) % 4];
        if (corners.first == corners.second) continue;
        next_[sides[i].first] = edge;
        break;
      }
    }
  }

  const Eigen::ArrayXXf& depth_;
  std::map<GridEdge, GridEdge> next_;
};

/// The means over `smoothed_px` of a closed curve, at places evenly `apart_px` apart.
Curve smoothed(const Curve& curve) {
  std::vector<double> along{0.0};
  for (size_t i = 0; i < curve.size(); ++i)
    along.push_back(along.back() + (curve[(i + 1) % curve.size()] - curve[i]).norm());
  const double length = along.back();
  const auto at = [&](double s) -> Eigen::Vector2d {
    s -= length * std::floor(s / length);
    const auto next =
        static_cast<size_t>(std::upper_bound(along.begin(), along.end() - 1, s) - along.begin());
    const double share = (s - along[next - 1]) / std::max(along[next] - along[next - 1], 1e-12);
    return curve[next - 1] + share * (curve[next % curve.size()] - curve[next - 1]);
  };
  Curve result;
  const auto count = static_cast<size_t>(std::round(length / apart_px));
  for (size_t i = 0; i < count; ++i) {
    const double s = length * static_cast<double>(i) / static_cast<double>(count);
    constexpr int samples = 12;
    Eigen::Vector2d sum(0, 0);
    for (int k = 0; k < samples; ++k)
      sum += at(s + smoothed_px * ((k + 0.5) / samples - 0.5));
    result.push_back(sum / samples);
  }
  return result;
}

}  // namespace

std::vector<Curve> outlines_px(const Eigen::ArrayXXf& depth_mm) {
  std::vector<Curve> curves;
  for (const Curve& curve : EdgeWalk(depth_mm).curves()) {
    if (Curve one = smoothed(curve); one.size() >= 3) curves.push_back(std::move(one));
  }
  return curves;
}

}  // namespace diastole::imaging
