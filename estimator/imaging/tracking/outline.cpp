#include "estimator/imaging/tracking/outline.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

namespace diastole::imaging {
namespace {

constexpr double tolerance_px = 0.5;

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

void keep_corners(std::span<const Eigen::Vector2d> points, Curve& kept) {
  const Eigen::Vector2d along = points.back() - points.front();
  const double length = along.norm();
  double most = tolerance_px;
  size_t farthest = 0;
  for (size_t i = 1; i + 1 < points.size(); ++i) {
    const Eigen::Vector2d from = points[i] - points.front();
    const double off =
        length > 0 ? std::abs(along.x() * from.y() - along.y() * from.x()) / length : from.norm();
    if (off > most) {
      most = off;
      farthest = i;
    }
  }
  if (farthest == 0) {
    kept.push_back(points.front());
    return;
  }
  keep_corners(points.first(farthest + 1), kept);
  keep_corners(points.subspan(farthest), kept);
}

}  // namespace

std::vector<Curve> outlines_px(const Eigen::ArrayXXf& depth_mm) {
  std::vector<Curve> simplified;
  for (Curve& curve : EdgeWalk(depth_mm).curves()) {
    curve.push_back(curve.front());
    Curve kept;
    keep_corners(curve, kept);
    if (kept.size() >= 3) simplified.push_back(std::move(kept));
  }
  return simplified;
}

}  // namespace diastole::imaging
