#include "estimator/effects/file_states.hpp"

#include <algorithm>
#include <cmath>

namespace diastole {

StatePrograms::StatePrograms(expressions::Graph& graph, const std::vector<expressions::NodeId>& begin,
                             const std::vector<expressions::NodeId>& rate, size_t input)
    : count(rate.size()), first_input(input), initial(graph, begin), rates(graph, rate) {
  std::vector<expressions::NodeId> own;
  for (size_t i = 0; i < count; ++i)
    own.push_back(graph.derivative(rate[i], first_input + i));
  slopes = expressions::Program(graph, own);
}

States::States(const StatePrograms& programs)
    : programs_(programs),
      x_(programs.count),
      rates_(programs.count),
      slopes_(programs.count),
      then_(programs.count),
      steps_(programs.count) {}

void States::look(std::vector<double>& inputs, double time_s) {
  if (programs_.count == 0) return;
  double* states = inputs.data() + programs_.first_input;
  if (!begun_) {
    programs_.initial.run(inputs.data(), states);
    return;
  }
  const double h = time_s - time_s_;
  if (h <= 0.0) {
    std::ranges::copy(x_, states);
    return;
  }
  constexpr double rounding = 1e-9;  // by which steps differ
  constexpr double series_below =
      1e-2;  // where the quotients lose digits; the series' next term is below 1e-13
  for (size_t i = 0; i < programs_.count; ++i) {
    const double z = h * slopes_[i];
    Step& step = steps_[i];
    if (std::abs(z - step.z) > rounding * std::abs(z)) {
      step.z = z;
      if (std::abs(z) < series_below) {
        step.second =
            0.5 + z * (1.0 / 6.0 + z * (1.0 / 24.0 + z * (1.0 / 120.0 + z * (1.0 / 720.0 + z / 5040.0))));
        step.first = 1.0 + z * step.second;
      } else {
        step.first = std::expm1(z) / z;
        step.second = (step.first - 1.0) / z;
      }
    }
    states[i] = x_[i] + h * step.first * rates_[i];
  }
  programs_.rates.run(inputs.data(), then_.data());
  for (size_t i = 0; i < programs_.count; ++i) {
    const double beyond = (then_[i] - slopes_[i] * states[i]) - (rates_[i] - slopes_[i] * x_[i]);
    states[i] += h * steps_[i].second * beyond;
  }
}

void States::pass(std::vector<double>& inputs, double time_s) {
  if (programs_.count == 0) return;
  const double* states = inputs.data() + programs_.first_input;
  std::copy(states, states + programs_.count, x_.begin());
  programs_.rates.run(inputs.data(), rates_.data());
  programs_.slopes.run(inputs.data(), slopes_.data());
  time_s_ = time_s;
  begun_ = true;
}

}  // namespace diastole
