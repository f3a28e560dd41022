#pragma once
// Nodes of a graph as a list of instructions over registers, for evaluation at many places: no allocation, no recursion, for
// numbers and for dual numbers alike. Thread-safe: a program holds no state.

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "estimator/expressions/graph.hpp"

namespace diastole::expressions {

class Program {
 public:
  static constexpr size_t most_registers = 512;

  Program() = default;
  /// Throws std::length_error if it would need more than most_registers.
  Program(const Graph& graph, std::span<const NodeId> outputs);

  /// `inputs` by their index in the graph, as far as they occur; one number for each of the outputs.
  template <class Scalar>
  void run(const Scalar* inputs, Scalar* outputs) const {
    constexpr size_t few = 48;  // what formulas of people need
    if (registers_ <= few) {
      run_in<Scalar, few>(inputs, outputs);
    } else {
      run_in<Scalar, most_registers>(inputs, outputs);
    }
  }
  [[nodiscard]] double operator()(const double* inputs) const {
    double output = 0.0;
    run(inputs, &output);
    return output;
  }

  [[nodiscard]] size_t outputs() const { return results_.size(); }
  [[nodiscard]] size_t instructions() const { return instructions_.size(); }

 private:
  using Register = uint16_t;
  struct Instruction {
    Operation operation;
    Register to, a, b, c;
  };
  struct Number {
    Register to;
    double value;
  };
  struct Input {
    Register to;
    uint16_t index;
  };

  template <class Scalar, size_t Room>
  void run_in(const Scalar* inputs, Scalar* outputs) const {
    std::array<Scalar, Room> r;
    for (const Number& number : numbers_)
      r[number.to] = constant<Scalar>(number.value);
    for (const Input& input : inputs_)
      r[input.to] = inputs[input.index];
    for (const Instruction& i : instructions_)
      r[i.to] = carried_out(i.operation, r[i.a], r[i.b], r[i.c]);
    for (size_t k = 0; k < results_.size(); ++k)
      outputs[k] = r[results_[k]];
  }

  std::vector<Number> numbers_;
  std::vector<Input> inputs_;
  std::vector<Instruction> instructions_;
  std::vector<Register> results_;
  size_t registers_ = 0;
};

}  // namespace diastole::expressions
