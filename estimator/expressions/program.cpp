#include "estimator/expressions/program.hpp"

#include <algorithm>
#include <stdexcept>

namespace diastole::expressions {
namespace {

/// The nodes that others are made of, each after those that it is made of.
std::vector<NodeId> in_order(const Graph& graph, std::span<const NodeId> outputs) {
  std::vector<bool> needed(graph.size(), false);
  std::vector<NodeId> open(outputs.begin(), outputs.end());
  while (!open.empty()) {
    const NodeId id = open.back();
    open.pop_back();
    if (needed[id]) continue;
    needed[id] = true;
    for (size_t i = 0; i < operands_of(graph[id].operation); ++i)
      open.push_back(graph[id].of[i]);
  }
  std::vector<NodeId> order;
  for (NodeId id = 0; id < graph.size(); ++id)  // a node's operands were there before it
    if (needed[id]) order.push_back(id);
  return order;
}

}  // namespace

Program::Program(const Graph& graph, std::span<const NodeId> outputs) {
  const std::vector<NodeId> order = in_order(graph, outputs);
  const size_t never = order.size();
  std::vector<size_t> last_use(graph.size(), 0);
  for (size_t k = 0; k < order.size(); ++k)
    for (size_t i = 0; i < operands_of(graph[order[k]].operation); ++i)
      last_use[graph[order[k]].of[i]] = k;
  for (const NodeId output : outputs)
    last_use[output] = never;

  std::vector<Register> place(graph.size(), 0);
  std::vector<Register> free;
  const auto take = [&] {
    if (free.empty()) {
      if (registers_ == most_registers) throw std::length_error("the formulas are too long");
      return static_cast<Register>(registers_++);
    }
    const Register allocated = free.back();
    free.pop_back();
    return allocated;
  };
  for (const NodeId id : order) {  // what is loaded stands first and is loaded once
    const Node& node = graph[id];
    if (node.operation == Operation::number) numbers_.push_back({place[id] = take(), node.value});
    if (node.operation == Operation::input)
      inputs_.push_back({place[id] = take(), static_cast<uint16_t>(node.value)});
  }
  for (size_t k = 0; k < order.size(); ++k) {
    const Node& node = graph[order[k]];
    const size_t count = operands_of(node.operation);
    if (count == 0) continue;
    const Register first = place[node.of[0]];
    Instruction instruction{node.operation, 0, first, first, first};
    if (count > 1) instruction.b = place[node.of[1]];
    if (count > 2) instruction.c = place[node.of[2]];
    for (size_t i = 0; i < count; ++i) {
      const NodeId operand = node.of[i];
      if (last_use[operand] != k || std::ranges::count(free, place[operand]) > 0) continue;
      free.push_back(place[operand]);
    }
    instruction.to = place[order[k]] = take();
    instructions_.push_back(instruction);
  }
  for (const NodeId output : outputs)
    results_.push_back(place[output]);
}

}  // namespace diastole::expressions
