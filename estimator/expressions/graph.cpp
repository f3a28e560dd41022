#include "estimator/expressions/graph.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace diastole::expressions {

using enum Operation;

NodeId Graph::keep(const Node& node) {
  const auto [at, is_new] = known_.try_emplace(node, static_cast<NodeId>(nodes_.size()));
  if (!is_new) return at->second;
  if (nodes_.size() >= most_nodes) throw std::length_error("the formulas are too long");
  nodes_.push_back(node);
  return at->second;
}

NodeId Graph::number(double value) {
  if (!std::isfinite(value)) throw std::domain_error("a part of it is not a finite number");
  return keep({.operation = Operation::number, .of = {}, .value = value});
}

NodeId Graph::input(size_t index) {
  return keep({.operation = Operation::input, .of = {}, .value = static_cast<double>(index)});
}

NodeId Graph::make(Operation operation, NodeId a, NodeId b, NodeId c) {
  const size_t count = operands_of(operation);
  const bool numbers = is_a_number(a) && (count < 2 || is_a_number(b)) && (count < 3 || is_a_number(c));
  if (numbers) {
    return number(carried_out(operation, nodes_[a].value, count > 1 ? nodes_[b].value : 0.0,
                              count > 2 ? nodes_[c].value : 0.0));
  }
  switch (operation) {
    case add:
      if (is_number(a, 0.0)) return b;
      if (is_number(b, 0.0)) return a;
      if (nodes_[b].operation == negate) return make(subtract, a, nodes_[b].of[0]);
      if (a > b) std::swap(a, b);
      break;
    case subtract:
      if (is_number(b, 0.0)) return a;
      if (is_number(a, 0.0)) return make(negate, b);
      if (nodes_[b].operation == negate) return make(add, a, nodes_[b].of[0]);
      break;
    case multiply:
      if (is_a_number(b) || (!is_a_number(a) && a > b)) std::swap(a, b);
      if (is_number(a, 0.0)) return a;
      if (is_number(a, 1.0)) return b;
      if (is_number(a, -1.0)) return make(negate, b);
      if (nodes_[b].operation == negate) return make(negate, make(multiply, a, nodes_[b].of[0]));
      // Numbers are gathered in front.
      if (const Node right = nodes_[b]; right.operation == multiply && is_a_number(right.of[0])) {
        if (is_a_number(a))
          return make(multiply, number(nodes_[a].value * nodes_[right.of[0]].value), right.of[1]);
        return make(multiply, right.of[0], make(multiply, a, right.of[1]));
      }
      if (const Node left = nodes_[a]; left.operation == multiply && is_a_number(left.of[0]))
        return make(multiply, left.of[0], make(multiply, left.of[1], b));
      if (nodes_[a].operation == negate) return make(negate, make(multiply, nodes_[a].of[0], b));
      break;
    case divide:
      if (is_number(a, 0.0)) return a;
      if (is_number(b, 1.0)) return a;
      break;
    case negate:
      if (nodes_[a].operation == negate) return nodes_[a].of[0];
      break;
    case select:
      if (is_a_number(a)) return nodes_[a].value != 0.0 ? b : c;
      if (b == c) return b;
      break;
    default:
      break;
  }
  Node node{.operation = operation, .of = {a}, .value = 0.0};
  if (count > 1) node.of[1] = b;
  if (count > 2) node.of[2] = c;
  return keep(node);
}

NodeId Graph::derivative(NodeId of, size_t by) {
  const auto known = derivatives_.find({of, by});
  if (known != derivatives_.end()) return known->second;
  const Node node = nodes_[of];
  const NodeId slope = node.operation == Operation::number ? number(0.0)
                       : node.operation == Operation::input
                           ? number(node.value == static_cast<double>(by) ? 1.0 : 0.0)
                           : derived(node, of, by);
  derivatives_.emplace(std::pair(of, by), slope);
  return slope;
}

NodeId Graph::derived(const Node& node, NodeId itself, size_t by) {
  const NodeId a = node.of[0];
  const NodeId b = node.of[1];
  const NodeId c = node.of[2];
  const size_t count = operands_of(node.operation);
  const NodeId da = derivative(a, by);
  const NodeId db = count > 1 ? derivative(b, by) : NodeId{};
  const NodeId dc = count > 2 ? derivative(c, by) : NodeId{};
  const NodeId none = number(0.0);
  const NodeId one = number(1.0);
  const auto chain = [&](auto&& slope) { return da == none ? none : product(slope(), da); };
  switch (node.operation) {
    case add:
    case subtract:
      return make(node.operation, da, db);
    case multiply:
      if (a == b) return scaled(2.0, product(a, da));
      return sum(product(da, b), product(a, db));
    case divide:
      return make(subtract, make(divide, da, b), make(divide, product(itself, db), b));
    case negate:
      return make(negate, da);
    case power: {
      const NodeId by_base = chain([&] { return product(b, make(power, a, make(subtract, b, one))); });
      return db == none ? by_base : sum(by_base, product(product(itself, make(logarithm, a)), db));
    }
    case root:
      return chain([&] { return make(divide, number(0.5), itself); });
    case exponential:
      return chain([&] { return itself; });
    case exponential_minus_one:
      return chain([&] { return sum(itself, one); });
    case logarithm:
      return chain([&] { return make(divide, one, a); });
    case logarithm_plus_one:
      return chain([&] { return make(divide, one, sum(one, a)); });
    case sine:
      return chain([&] { return make(cosine, a); });
    case cosine:
      return chain([&] { return make(negate, make(sine, a)); });
    case hyperbolic_tangent:
      return chain([&] { return make(subtract, one, product(itself, itself)); });
    case arctangent:
      return chain([&] { return make(divide, one, sum(one, product(a, a))); });
    case magnitude:
      return chain([&] { return make(sign, a); });
    case minimum:
      return da == db ? da : make(select, make(less, b, a), db, da);
    case maximum:
      return da == db ? da : make(select, make(less, a, b), db, da);
    case normal:
      return chain([&] {
        const double peak = 1.0 / std::sqrt(2.0 * std::numbers::pi);
        return scaled(peak, make(exponential, scaled(-0.5, product(a, a))));
      });
    case select:
      return make(select, a, db, dc);
    case sign:
    case less:
    case at_most:
    case Operation::number:
    case Operation::input:
      break;
  }
  return none;
}

NodeId Graph::substituted(NodeId of, size_t at, NodeId by) {
  std::map<NodeId, NodeId> done;
  const auto substitute = [&](const auto& self, NodeId id) -> NodeId {
    const Node node = nodes_[id];
    if (node.operation == Operation::number) return id;
    if (node.operation == Operation::input) return node.value == static_cast<double>(at) ? by : id;
    if (const auto known = done.find(id); known != done.end()) return known->second;
    std::array<NodeId, 3> operands{};
    for (size_t i = 0; i < operands_of(node.operation); ++i)
      operands[i] = self(self, node.of[i]);
    return done[id] = make(node.operation, operands[0], operands[1], operands[2]);
  };
  return substitute(substitute, of);
}

bool Graph::depends_on(NodeId of, size_t at) const {
  std::vector<bool> seen(of + 1, false);
  std::vector<NodeId> open{of};
  while (!open.empty()) {
    const NodeId id = open.back();
    open.pop_back();
    if (seen[id]) continue;
    seen[id] = true;
    const Node& node = nodes_[id];
    if (node.operation == Operation::input && node.value == static_cast<double>(at)) return true;
    for (size_t i = 0; i < operands_of(node.operation); ++i)
      open.push_back(node.of[i]);
  }
  return false;
}

}  // namespace diastole::expressions
