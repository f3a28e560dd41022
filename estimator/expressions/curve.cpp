#include "estimator/expressions/curve.hpp"

#include <Eigen/Dense>
#include <array>
#include <utility>

namespace diastole::expressions {
namespace {

/// value + slope d + bend d^2 + twist d^3 at d = x - from.
struct Piece {
  double from = 0.0, value = 0.0, slope = 0.0, bend = 0.0, twist = 0.0;
};

/// Second derivatives at the points: continuous, and none at the ends.
Eigen::VectorXd second_derivatives(const std::vector<double>& at, const std::vector<double>& values) {
  const auto count = static_cast<Eigen::Index>(at.size());
  Eigen::MatrixXd equations = Eigen::MatrixXd::Identity(count, count);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
  for (size_t k = 1; k + 1 < at.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    const double before = at[k] - at[k - 1];
    const double behind = at[k + 1] - at[k];
    equations.row(row).segment<3>(row - 1) << before / 6.0, (before + behind) / 3.0, behind / 6.0;
    right[row] = (values[k + 1] - values[k]) / behind - (values[k] - values[k - 1]) / before;
  }
  return equations.partialPivLu().solve(right);
}

/// The straight ends and what is between them, from the left.
std::vector<Piece> pieces_of(const std::vector<double>& at, const std::vector<double>& values) {
  const Eigen::VectorXd bends = second_derivatives(at, values);
  std::vector<Piece> pieces;
  double slope_behind = 0.0;
  for (size_t k = 0; k + 1 < at.size(); ++k) {
    const double width = at[k + 1] - at[k];
    const double left = bends[static_cast<Eigen::Index>(k)];
    const double right = bends[static_cast<Eigen::Index>(k + 1)];
    const double slope = (values[k + 1] - values[k]) / width - width * (2.0 * left + right) / 6.0;
    if (k == 0) pieces.push_back({at[0], values[0], slope, 0.0, 0.0});
    pieces.push_back({at[k], values[k], slope, 0.5 * left, (right - left) / (6.0 * width)});
    slope_behind = slope + 0.5 * width * (left + right);
  }
  pieces.push_back({at.back(), values.back(), slope_behind, 0.0, 0.0});
  return pieces;
}

NodeId of_piece(Graph& graph, const Piece& piece, NodeId x) {
  const NodeId d = graph.make(Operation::subtract, x, graph.number(piece.from));
  NodeId sum = graph.number(piece.twist);
  for (const double coefficient : {piece.bend, piece.slope, piece.value})
    sum = graph.sum(graph.number(coefficient), graph.product(sum, d));
  return sum;
}

/// Those from `first` on, by halves. Piece i + 1 begins at at[i].
NodeId chosen(Graph& graph, const std::vector<double>& at, const std::vector<Piece>& pieces, size_t first,
              size_t last, NodeId x) {
  if (first == last) return of_piece(graph, pieces[first], x);
  const size_t middle = (first + last) / 2;
  return graph.make(Operation::select, graph.make(Operation::less, x, graph.number(at[middle])),
                    chosen(graph, at, pieces, first, middle, x),
                    chosen(graph, at, pieces, middle + 1, last, x));
}

}  // namespace

Curve tabulated_curve(const std::vector<double>& at, const std::vector<double>& values, const Unit& of,
                      const Unit& unit) {
  return {of, unit, [at, pieces = pieces_of(at, values)](Graph& graph, NodeId x) {
            return chosen(graph, at, pieces, 0, pieces.size() - 1, x);
          }};
}

}  // namespace diastole::expressions
