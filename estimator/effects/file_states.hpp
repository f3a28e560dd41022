#pragma once
// The states of an effect of a file along one run.

#include <vector>

#include "estimator/expressions/program.hpp"

namespace diastole {

struct StatePrograms {
  size_t count = 0;
  size_t first_input = 0;  ///< of a state
  expressions::Program initial;
  expressions::Program rates;
  expressions::Program slopes;  ///< of each rate by its own state

  StatePrograms() = default;
  StatePrograms(expressions::Graph& graph, const std::vector<expressions::NodeId>& initial,
                const std::vector<expressions::NodeId>& rates, size_t first_input);
};

/// x' = f(x, u), u what drives: with J the diagonal of df/dx and N = f - J x, z = h J,
///
///   x* = x + h phi1(z) f(x, u0),   x1 = x* + h phi2(z) (N(x*, u1) - N(x, u0))
///
/// phi1 = (e^z - 1)/z, phi2 = (phi1 - 1)/z. S. M. Cox, P. C. Matthews, J. Comput. Phys. 176 (2002) 430, ETD2RK.
class States {
 public:
  explicit States(const StatePrograms& programs);

  /// Puts the states at `time_s` into `inputs`, which hold what drives them there. Before the first `pass`: their initial
  /// values.
  void look(std::vector<double>& inputs, double time_s);
  /// Goes on to the time just looked at.
  void pass(std::vector<double>& inputs, double time_s);

 private:
  struct Step {
    double z = 0.0, first = 1.0, second = 0.5;  ///< z and phi1, phi2 there
  };
  const StatePrograms& programs_;
  std::vector<double> x_, rates_, slopes_, then_;
  std::vector<Step> steps_;
  double time_s_ = 0.0;
  bool begun_ = false;
};

}  // namespace diastole
