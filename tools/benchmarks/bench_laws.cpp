// What a hand-written fast path gains over dual numbers: time of one stress-and-tangent evaluation and of one
// stress evaluation for every law, on this machine.
//
//   tools/bench laws

#include <fmt/format.h>

#include <chrono>
#include <vector>

#include "estimator/materials/law.hpp"

namespace {

using diastole::Law;
using Tensor = diastole::SymmetricTensor<double>;

constexpr size_t evaluations = 200'000;

/// Nanoseconds a call; `evaluate` gives a number that keeps the work from being optimised away.
template <class Evaluate>
double time_ns(const Evaluate& evaluate) {
  double kept = 0.0;
  const auto begun = std::chrono::steady_clock::now();
  for (size_t i = 0; i < evaluations; ++i)
    kept += evaluate(1e-9 * static_cast<double>(i));
  const std::chrono::duration<double, std::nano> taken = std::chrono::steady_clock::now() - begun;
  volatile double sink = kept;
  (void)sink;
  return taken.count() / static_cast<double>(evaluations);
}

}  // namespace

int main() {
  fmt::print("{:<18}{:>16}{:>20}{:>8}{:>12}\n", "law", "response, ns", "by duals, ns", "gain", "stress, ns");
  for (const Law* law : diastole::all_laws()) {
    std::vector<double> values;
    for (const diastole::LawParameter& parameter : law->parameters())
      values.push_back(parameter.typical);
    const auto at = [](double nudge) { return Tensor{1.21 + nudge, 0.93, 1.06, 0.11, -0.07, 0.05}; };
    const double fast = time_ns([&](double n) { return law->response(at(n), values).tangent(0, 0); });
    const double dual = time_ns([&](double n) { return law->dual_response(at(n), values).tangent(0, 0); });
    const double stress = time_ns([&](double n) { return law->stress(at(n), values)[0]; });
    fmt::print("{:<18}{:>16.1f}{:>20.1f}{:>8.1f}{:>12.1f}\n", law->name(), fast, dual, dual / fast, stress);
  }
}
