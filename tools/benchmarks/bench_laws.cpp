// What a hand-written fast path gains over dual numbers: time of one stress-and-tangent evaluation and of one
// stress evaluation for every law, on this machine; and what the laws of examples/laws cost over the built-in ones that they
// express.
//
//   tools/bench laws

#include <fmt/format.h>

#include <ctime>
#include <vector>

#include "estimator/materials/file_law.hpp"

namespace {

using diastole::Law;
using Tensor = diastole::SymmetricTensor<double>;

constexpr size_t evaluations = 20'000;

/// Nanoseconds a call; `evaluate` gives a number that keeps the work from being optimised away.
template <class Evaluate>
double time_ns(const Evaluate& evaluate) {
  double kept = 0.0;
  const std::clock_t begun = std::clock();  // of the processor: what is beside costs time too
  for (size_t i = 0; i < evaluations; ++i)
    kept += evaluate(1e-9 * static_cast<double>(i));
  const std::clock_t elapsed = std::clock() - begun;
  volatile double sink = kept;
  (void)sink;
  return 1e9 * static_cast<double>(elapsed) / CLOCKS_PER_SEC / static_cast<double>(evaluations);
}

struct Times {
  double response_ns, dual_ns, stress_ns;
};

Times times_of(const Law& law) {
  std::vector<double> values;
  for (const diastole::LawParameter& parameter : law.parameters())
    values.push_back(parameter.typical);
  const auto at = [](double step) { return Tensor{1.21 + step, 0.93, 1.06, 0.11, -0.07, 0.05}; };
  return {time_ns([&](double n) { return law.response(at(n), values).tangent(0, 0); }),
          time_ns([&](double n) { return law.dual_response(at(n), values).tangent(0, 0); }),
          time_ns([&](double n) { return law.stress(at(n), values)[0]; })};
}

}  // namespace

int main() {
  fmt::print("{:<18}{:>16}{:>20}{:>8}{:>12}\n", "law", "response, ns", "by duals, ns", "gain", "stress, ns");
  for (const Law* law : diastole::all_laws()) {
    const auto [fast, dual, stress] = times_of(*law);
    fmt::print("{:<18}{:>16.1f}{:>20.1f}{:>8.1f}{:>12.1f}\n", law->name(), fast, dual, dual / fast, stress);
  }
  fmt::print("\n{:<18}{:>16}{:>20}{:>12}\n", "as a file", "response, ns", "over built in", "stress");
  for (const char* name : {"mooney-rivlin", "guccione", "holzapfel-ogden"}) {
    const Times built_in = times_of(*diastole::find_law(name));
    const Times file =
        times_of(diastole::law_of_file(fmt::format(DIASTOLE_SOURCE_DIR "/examples/laws/{}.law.toml", name)));
    fmt::print("{:<18}{:>16.1f}{:>20.2f}{:>12.2f}\n", name, file.response_ns,
               file.response_ns / built_in.response_ns, file.stress_ns / built_in.stress_ns);
  }
}
