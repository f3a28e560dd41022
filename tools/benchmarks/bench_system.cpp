// What the elastic solver's choices are worth: the loop over elements by this project's threads against OpenMP's, and
// MUMPS against the other direct solvers that Debian packages, on the gel's own tangents.
//
//   tools/bench system [--rounds N]     least times of N rounds, taken in turn
//
// docs/decisions/0012-newton-and-factorisation.md rests on its figures. On a busy machine, the tangent of 8x4x1 at 3 kPa with analysis and
// one solution: MUMPS 75 ms, SparseLU 259, UMFPACK 404, LDLT without pivoting 368. All element tangents of 8x8x4 in two threads:
// parallel_for 223 and 292 ms, OpenMP 328 and 448.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseLU>
#include <Eigen/UmfPackSupport>
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <limits>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/fe/sparse_factor.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

using Matrix = Eigen::SparseMatrix<double>;

constexpr size_t threads = 2;
constexpr std::array<std::array<size_t, 3>, 2> loop_meshes{{{8, 4, 1}, {8, 8, 4}}},
    factor_meshes{{{8, 4, 1}, {8, 6, 2}}};

double milliseconds(const std::function<void()>& work) {
  const auto begun = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begun).count();
}

struct Contender {
  const char* name;
  std::function<void()> work;
  double least_ms = std::numeric_limits<double>::infinity();
};

void race(std::vector<Contender>& contenders, int rounds) {
  for (int round = 0; round < rounds; ++round) {
    for (Contender& contender : contenders)
      contender.least_ms = std::min(contender.least_ms, milliseconds(contender.work));
  }
}

ElasticModel gel(const std::array<size_t, 3>& elements) {
  AnnulusShape shape;
  shape.elements = elements;
  return ElasticModel(make_annulus(shape), *find_law("neo-hookean"), {.parameters = {6.5}});
}

/// All element tangents of a system, colour by colour, `loop(count, body)` sharing each colour's elements.
template <class Loop>
void assemble(const ElasticSystem& system, const std::vector<ReferenceElement>& reference,
              const std::vector<ElementState>& states, std::vector<double>& values, const Loop& loop) {
  for (const std::vector<size_t>& colour : system.equations().colours()) {
    loop(colour.size(), [&](size_t i) {
      thread_local ElementTangent local;
      const size_t e = colour[i];
      element_tangent(reference[e], states[e], system.law(), system.parameters(e), local);
      system.equations().add_tangent(e, local, values);
    });
  }
}

void race_loops(const std::array<size_t, 3>& elements, int rounds) {
  ElasticModel model = gel(elements);
  const ElasticSystem& system = model.system();
  const ElasticState rest = model.rest_state();
  std::vector<ReferenceElement> reference;
  std::vector<ElementState> states;
  for (size_t e = 0; e < model.mesh().element_count(); ++e) {
    reference.push_back(make_reference_element(model.mesh(), e));
    ElementState& state = states.emplace_back();
    state.position_mm = model.mesh().gather(e, rest.position_mm);
    for (size_t m = 0; m < corners; ++m)
      state.pressure_kPa[m] = rest.lagrange_pressure_kPa[system.pressures().unknown[e][m]];
  }
  std::vector<double> values(system.equations().entries());
  const auto one = [](size_t count, const auto& body) {
    for (size_t i = 0; i < count; ++i)
      body(i);
  };
  const auto own = [](size_t count, const auto& body) { parallel_for(count, threads, body); };
  const auto openmp = [](size_t count, const auto& body) {
#pragma omp parallel for schedule(dynamic) num_threads(threads)
    for (size_t i = 0; i < count; ++i)
      body(i);
  };
  std::vector<Contender> contenders{
      {"one thread", [&] { assemble(system, reference, states, values, one); }},
      {"std::jthread, two", [&] { assemble(system, reference, states, values, own); }},
      {"OpenMP, two", [&] { assemble(system, reference, states, values, openmp); }}};
  race(contenders, 10 * rounds);
  for (const Contender& contender : contenders) {
    fmt::print("{}×{}×{}  {:<20}{:>9.2f} ms{:>8.2f} times as fast\n", elements[0], elements[1], elements[2],
               contender.name, contender.least_ms, contenders.front().least_ms / contender.least_ms);
  }
  std::fflush(stdout);
}

template <class Solver>
std::function<void()> factorisation(const Matrix& matrix, const Eigen::VectorXd& right_side, double& miss) {
  return [&matrix, &right_side, &miss] {
    Solver solver;
    solver.compute(matrix);
    const Eigen::VectorXd x = solver.solve(right_side);
    miss = (matrix * x - right_side).norm() / right_side.norm();
  };
}

void race_factors(const std::array<size_t, 3>& elements, int rounds) {
  ElasticModel model = gel(elements);
  const Solution loaded = model.solve(3.0);
  const EquationSystem& equations = model.system().equations();
  const std::vector<double> values = model.system().tangent(loaded.state);
  const auto size = static_cast<Eigen::Index>(equations.unknowns());
  std::vector<Eigen::Triplet<double, int>> triplets;
  for (size_t n = 0; n < values.size(); ++n) {
    const int row = equations.rows()[n] - 1, column = equations.columns()[n] - 1;
    triplets.emplace_back(row, column, values[n]);
    if (row != column) triplets.emplace_back(column, row, values[n]);
  }
  Matrix matrix(size, size);
  matrix.setFromTriplets(triplets.begin(), triplets.end());
  const Eigen::VectorXd right_side = Eigen::VectorXd::Ones(size);
  std::array<double, 4> miss{};
  const auto by_mumps = [&] {
    SparseFactor factor(static_cast<size_t>(size), equations.rows().subspan(0, values.size()),
                        equations.columns().subspan(0, values.size()));
    std::vector<double> numbers = values;
    factor.factorise(numbers);
    Eigen::VectorXd x = right_side;
    factor.solve({x.data(), static_cast<size_t>(x.size())});
    miss[0] = (matrix * x - right_side).norm() / right_side.norm();
  };
  std::vector<Contender> contenders{
      {"MUMPS, L D Lᵀ", by_mumps},
      {"Eigen SparseLU", factorisation<Eigen::SparseLU<Matrix>>(matrix, right_side, miss[1])},
      {"UMFPACK", factorisation<Eigen::UmfPackLU<Matrix>>(matrix, right_side, miss[2])},
      {"Eigen LDLᵀ, unpivoted", factorisation<Eigen::SimplicialLDLT<Matrix>>(matrix, right_side, miss[3])}};
  race(contenders, rounds);
  for (size_t i = 0; i < contenders.size(); ++i) {
    fmt::print("{:>6} unknowns  {:<24}{:>10.1f} ms   residual {:.0e}\n", size, contenders[i].name,
               contenders[i].least_ms, miss[i]);
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  CLI::App app("Times the element loop and the factorisation against what could be used instead.");
  int rounds = 3;
  app.add_option("--rounds", rounds, "how often each is timed, in turn")->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  fmt::print("Element tangents, least of {} rounds:\n", 10 * rounds);
  for (const auto& mesh : diastole::loop_meshes)
    diastole::race_loops(mesh, rounds);
  fmt::print("\nAnalysis, factorisation and one solution, least of {} rounds:\n", rounds);
  for (const auto& mesh : diastole::factor_meshes)
    diastole::race_factors(mesh, rounds);
}
