#pragma once
// Formulas as a graph in which every distinct subexpression stands once. A derivative is a node of the same graph: the
// arithmetic of dual numbers carried out on nodes instead of numbers, so that a stress, its energy and its tangent share what
// they have in common.

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "estimator/expressions/operations.hpp"

namespace diastole::expressions {

using NodeId = uint32_t;

struct Node {
  Operation operation = Operation::number;
  std::array<NodeId, 3> of = {};
  double value = 0.0;  ///< of a number; of an input its index

  auto operator<=>(const Node&) const = default;
};

class Graph {
 public:
  /// What formulas grow to at most; derivatives of formulas that people write stay far below.
  static constexpr size_t most_nodes = 20'000;

  /// Throws std::domain_error unless finite.
  NodeId number(double value);
  NodeId input(size_t index);
  /// Simplified where that changes no value: numbers are computed, + 0, * 1 and * 0 vanish. Throws std::length_error beyond
  /// most_nodes.
  NodeId make(Operation operation, NodeId a, NodeId b = 0, NodeId c = 0);
  /// By an input.
  NodeId derivative(NodeId of, size_t input);
  /// The node with another one in an input's place.
  NodeId substituted(NodeId of, size_t input, NodeId by);

  [[nodiscard]] const Node& operator[](NodeId node) const { return nodes_[node]; }
  [[nodiscard]] bool depends_on(NodeId node, size_t input) const;
  [[nodiscard]] bool is_number(NodeId node, double value) const {
    return nodes_[node].operation == Operation::number && nodes_[node].value == value;
  }
  [[nodiscard]] size_t size() const { return nodes_.size(); }

  NodeId sum(NodeId a, NodeId b) { return make(Operation::add, a, b); }
  NodeId product(NodeId a, NodeId b) { return make(Operation::multiply, a, b); }
  NodeId scaled(double factor, NodeId a) { return product(number(factor), a); }

 private:
  NodeId keep(const Node& node);
  NodeId derived(const Node& node, NodeId itself, size_t input);
  [[nodiscard]] bool is_a_number(NodeId node) const { return nodes_[node].operation == Operation::number; }

  std::vector<Node> nodes_;
  std::map<Node, NodeId> known_;
  std::map<std::pair<NodeId, size_t>, NodeId> derivatives_;
};

}  // namespace diastole::expressions
