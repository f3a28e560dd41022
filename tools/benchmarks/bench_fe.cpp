// The forward solution of the gel annulus at 6 kPa against other programs, at equal accuracy, in one run.
//
//   tools/bench fe [--rounds N]      peers come from tools/setup --peers; an absent one is skipped visibly
//   tools/bench fe --growth [--most ELEMENTS] [--figure FILE.svg]     our cost from 32 to 4000 elements
//
// Each program climbs its ladder of meshes. Its mesh is the coarsest one from which on all finer ones keep the
// accuracy, so that an error that happens to change its sign does not count. Then all solve in turn, N times
// over; medians are reported. Targets: ten times as fast as FEniCSx, by processor seconds of the solution on that mesh, and a
// solution's time that grows with the unknowns by n^1.5 at most; what misses its own is marked MISSED and makes the exit code 1.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "protocol/contract/exit_code.hpp"
#include "protocol/signal/median.hpp"
#include "tools/benchmarks/annulus_growth.hpp"
#include "tools/benchmarks/annulus_solver.hpp"
#include "tools/benchmarks/figure_targets.hpp"

namespace diastole {
namespace {

struct Accuracy {
  const char* what;
  std::function<double(const AnnulusAnswer&)> error;
};

constexpr double demanded = 1e-3;
constexpr double least_speed_up = 10;  // over FEniCSx

std::string name_of(const AnnulusElements& elements) {
  return fmt::format("{}×{}×{}", elements[0], elements[1], elements[2]);
}

std::vector<AnnulusAnswer> climb(const AnnulusSolver& solver, const AnnulusWorkplace& place) {
  fmt::print("\n{}: {}\n", solver.name, solver.discretisation);
  std::vector<AnnulusAnswer> answers;
  for (const AnnulusElements& elements : solver.ladder) {
    const AnnulusAnswer& answer = answers.emplace_back(solve_annulus(solver, elements, place));
    fmt::print("  {:<8} {:>7} unknowns   inner wall {:+.3f} %   worst of five radii {:+.3f} %\n",
               name_of(elements), answer.unknowns, 100 * answer.inner_error(), 100 * answer.worst_error());
    std::fflush(stdout);
  }
  return answers;
}

/// The coarsest mesh that keeps the accuracy together with all finer ones.
std::optional<AnnulusElements> coarsest(const std::vector<AnnulusAnswer>& answers, const Accuracy& accuracy) {
  std::optional<AnnulusElements> found;
  for (auto answer = answers.rbegin(); answer != answers.rend(); ++answer) {
    if (std::abs(accuracy.error(*answer)) > demanded) break;
    found = answer->elements;
  }
  return found;
}

/// The coarsest mesh that meets the accuracy, finer ones off again or not: an error that happens to change its sign.
std::optional<AnnulusElements> first_to_meet(const std::vector<AnnulusAnswer>& answers,
                                             const Accuracy& accuracy) {
  const auto met = std::find_if(answers.begin(), answers.end(), [&](const AnnulusAnswer& answer) {
    return std::abs(accuracy.error(answer)) <= demanded;
  });
  if (met == answers.end()) return {};
  return met->elements;
}

struct Racer {
  const AnnulusSolver* solver;
  AnnulusElements elements;
  bool accurate;
  bool by_chance = false;  ///< a finer mesh is off again
  std::vector<AnnulusAnswer> runs{};

  [[nodiscard]] double middle(const std::function<double(const AnnulusAnswer&)>& figure) const {
    std::vector<double> values;
    for (const AnnulusAnswer& run : runs)
      values.push_back(figure(run));
    return signal::median(std::move(values));
  }
};

void print_race(const std::vector<Racer>& racers, const Accuracy& accuracy, FigureTargets& targets) {
  fmt::print("\n{} within 0.1 % (medians of {})\n", accuracy.what, racers.front().runs.size());
  fmt::print("{:<10}{:<10}{:>9}{:>9}{:>10}{:>10}{:>10}{:>10}{:>9}  {}\n", "", "mesh", "unknowns", "error %",
             "solve s", "(cpu)", "whole s", "(cpu)", "peak MB", "Newton steps");
  for (const Racer& racer : racers) {
    const AnnulusAnswer& first = racer.runs.front();
    fmt::print("{:<10}{:<10}{:>9}{:>+9.3f}{:>10.3f}{:>10.3f}{:>10.3f}{:>10.3f}{:>9.0f}  {}\n",
               racer.solver->name, name_of(racer.elements), first.unknowns, 100 * accuracy.error(first),
               racer.middle([](const auto& run) { return run.solve_wall_s; }),
               racer.middle([](const auto& run) { return run.solve_processor_s; }),
               racer.middle([](const auto& run) { return run.process.wall_s; }),
               racer.middle([](const auto& run) { return run.process.processor_s; }),
               racer.middle([](const auto& run) { return run.process.peak_MB; }), first.newton);
  }
  const Racer& own = racers.front();
  for (size_t i = 1; i < racers.size(); ++i) {
    const auto ratio = [&](const std::function<double(const AnnulusAnswer&)>& figure) {
      return racers[i].middle(figure) / own.middle(figure);
    };
    const double solve_cpu = ratio([](const auto& run) { return run.solve_processor_s; });
    const bool has_target = racers[i].solver->name == "FEniCSx" && !racers[i].by_chance;
    fmt::print(
        "Diastole is faster than {} by: solve {:.1f} (cpu {:.1f}{}), whole process {:.1f} (cpu {:.1f}){}\n",
        racers[i].solver->name + " on " + name_of(racers[i].elements),
        ratio([](const auto& run) { return run.solve_wall_s; }), solve_cpu,
        has_target ? targets.mark(own.accurate && solve_cpu >= least_speed_up) : "",
        ratio([](const auto& run) { return run.process.wall_s; }),
        ratio([](const auto& run) { return run.process.processor_s; }),
        racers[i].by_chance  ? ", on a mesh that meets it by chance: a finer one does not"
        : racers[i].accurate ? ""
                             : ", at least: it does not reach the accuracy on its finest mesh");
  }
}

void race(const std::vector<const AnnulusSolver*>& solvers,
          const std::vector<std::vector<AnnulusAnswer>>& answers, const Accuracy& accuracy, int rounds,
          const AnnulusWorkplace& place, FigureTargets& targets) {
  std::vector<Racer> racers;
  for (size_t i = 0; i < solvers.size(); ++i) {
    const std::optional<AnnulusElements> found = coarsest(answers[i], accuracy);
    racers.push_back({solvers[i], found.value_or(solvers[i]->ladder.back()), found.has_value()});
    const std::optional<AnnulusElements> first = first_to_meet(answers[i], accuracy);
    const bool peer = i > 0;
    if (peer && first && first != found) racers.push_back({solvers[i], *first, true, true});
  }
  for (int round = 0; round < rounds; ++round) {
    for (Racer& racer : racers)
      racer.runs.push_back(solve_annulus(*racer.solver, racer.elements, place));
  }
  print_race(racers, accuracy, targets);
}

void compare(const std::vector<AnnulusSolver>& all, int rounds, const AnnulusWorkplace& place,
             FigureTargets& targets) {
  std::vector<const AnnulusSolver*> installed;
  std::vector<std::vector<AnnulusAnswer>> answers;
  fmt::print("Gel annulus, 6 kPa, C1 6.5 kPa, whole circumference, one thread each, meshes graded alike\n");
  for (const AnnulusSolver& solver : all) {
    if (!is_installed(solver, place)) {
      fmt::print("\n{}: skipped, it is not installed (tools/setup --peers)\n", solver.name);
      continue;
    }
    installed.push_back(&solver);
    answers.push_back(climb(solver, place));
  }
  race(installed, answers, {"inner wall at the equator", &AnnulusAnswer::inner_error}, rounds, place,
       targets);
  race(installed, answers, {"all five radii", &AnnulusAnswer::worst_error}, rounds, place, targets);
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  CLI::App app("Times the forward solution of the gel annulus against other programs.");
  int rounds = 3;
  bool growth = false;
  size_t most_elements = 4000;
  std::string figure;
  std::vector<std::string> one;
  app.add_option("--rounds", rounds, "how often each program solves, in turn")->check(CLI::PositiveNumber);
  app.add_flag("--growth", growth, "this project's cost over the size of the mesh, instead");
  app.add_option("--most", most_elements, "with --growth: the largest mesh, in elements");
  app.add_option("--figure", figure, "with --growth: draw it into FILE.svg");
  app.add_option("--solve", one, "solve once on AROUND UP THROUGH elements and write RESULT.json")
      ->expected(4);
  CLI11_PARSE(app, argc, argv);
  try {
    if (!one.empty()) {
      diastole::solve_annulus_here({std::stoul(one[0]), std::stoul(one[1]), std::stoul(one[2])}, one[3]);
      return static_cast<int>(diastole::ExitCode::done);
    }
    const std::vector<diastole::AnnulusSolver> solvers =
        diastole::annulus_solvers(std::filesystem::read_symlink("/proc/self/exe"));
    const diastole::AnnulusWorkplace place{std::filesystem::absolute("build/bench-fe"),
                                           std::filesystem::absolute("tools/benchmarks/peers")};
    diastole::FigureTargets targets;
    if (growth) {
      diastole::measure_growth(solvers.front(), most_elements, figure, place, targets);
    } else {
      diastole::compare(solvers, rounds, place, targets);
    }
    return static_cast<int>(targets.conclude());
  } catch (const std::exception& error) {
    fmt::print(stderr, "bench_fe: {}\n", error.what());
    return static_cast<int>(diastole::ExitCode::negative);
  }
}
