// Estimation: the paper's 32-parameter gel (seven iterations, 2 h on eight Power4 processors), exact sensitivities
// against finite differences on the same problem, and the whole of its Table 1.
//
//   tools/bench fit                          gel estimate, sensitivities and the whole of `diastole fit`, on examples/phantom-a
//   tools/bench fit --paper STUDY            the study's parameters by the paper's search, beside ours; nothing else
//   tools/bench fit --table LV.study.toml --cells lv.cells.csv
//                                            also Table 1: 4 noise levels x 3 numbers of frames x 10 refits, of the
//                                            points that the paper's images would give; goes on after an interruption
// Targets are of two processors; what misses its own is marked MISSED and makes the exit code 1.

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include "estimator/fit/elastic_motion.hpp"
#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/montecarlo/cells_file.hpp"
#include "estimator/montecarlo/montecarlo.hpp"
#include "estimator/montecarlo/worker_pool.hpp"
#include "protocol/contract/exit_code.hpp"
#include "protocol/signal/median.hpp"
#include "tools/benchmarks/figure_targets.hpp"
#include "tools/benchmarks/paper_search.hpp"
#include "tools/benchmarks/timed_process.hpp"

namespace diastole {
namespace {

constexpr double regional_fit_s = 1, whole_fit_s = 1.5, table_s = 300;

FigureTargets targets;

struct Stopwatch {
  std::chrono::steady_clock::time_point begun = std::chrono::steady_clock::now();
  std::clock_t cpu_begun = std::clock();

  [[nodiscard]] double wall_s() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  }
  [[nodiscard]] double cpu_s() const {
    return static_cast<double>(std::clock() - cpu_begun) / static_cast<double>(CLOCKS_PER_SEC);
  }
};

constexpr const char* phantom_a = DIASTOLE_SOURCE_DIR "/examples/phantom-a.study.toml";

Study regional_gel() {
  Study study = read_study(phantom_a);
  study.law.parameters[0].vary = Variation::element;
  return study;
}

void bench_estimate(const Study& study, const Measurement& measurement) {
  for (const auto kind : {Smoothness::Kind::evidence, Smoothness::Kind::none}) {
    Study smooth = study;
    smooth.law.parameters[0].smoothness.kind = kind;
    const Stopwatch watch;
    const FitRecord record = fit_study(smooth, measurement, {});
    fmt::print(
        "  {:<22} {:>2} iterations, {} equilibria, {} s wall, {:.1f} s processor; mean C1 {:.3f} ± "
        "{:.3f} kPa; "
        "{}\n",
        kind == Smoothness::Kind::evidence ? "smooth by evidence:" : "without smoothness:", record.iterations,
        record.forward_solves, targets.at_most(watch.wall_s(), regional_fit_s, "{:.2f}"), watch.cpu_s(),
        record.parameters[0].value, record.parameters[0].se, record.reason);
    std::fflush(stdout);
  }
}

/// The command, from its start to its end, with its examination of the study; the median of three.
void bench_command() {
  const std::filesystem::path scratch =
      std::filesystem::temp_directory_path() / fmt::format("diastole-bench-fit-{}", ::getpid());
  std::filesystem::create_directories(scratch);
  const std::vector<std::string> command{DIASTOLE_PROGRAM, "fit", phantom_a, "-o", "fit.json"};
  std::vector<double> wall_s;
  int exit_code = 0;
  for (int round = 0; round < 3; ++round) {
    const ProcessCost cost = run_timed(command, scratch, scratch / "log");
    wall_s.push_back(cost.wall_s);
    if (cost.exit_code != 0) exit_code = cost.exit_code;
  }
  std::filesystem::remove_all(scratch);
  fmt::print("`diastole fit examples/phantom-a.study.toml`, whole: {} s wall ({:g}), exit {}{}\n",
             targets.at_most(signal::median(std::move(wall_s)), whole_fit_s, "{:.2f}"), whole_fit_s,
             exit_code, targets.mark(exit_code == 0));
  std::fflush(stdout);
}

void bench_sensitivities(const Study& study, const Measurement& measurement) {
  ElasticModel model = make_model(study);
  const EstimatedParameters estimated = estimated_parameters(study, model);
  ElasticMotion motion(std::move(model), estimated.groups);
  JointProblem problem(motion, estimated.values, measurement, locator_for(study.specimen));
  Eigen::VectorXd q = problem.start();
  if (!problem.find_points(q) || !problem.residuals(q)) return;
  const Stopwatch exact_watch;
  const Eigen::MatrixXd exact = problem.jacobian(q);
  const double exact_s = exact_watch.cpu_s();
  const Eigen::VectorXd here = *problem.residuals(q);
  Eigen::MatrixXd differences(exact.rows(), exact.cols());
  const Stopwatch difference_watch;
  constexpr double step = 1e-4;
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    Eigen::VectorXd moved = q;
    moved[i] += step;
    const std::optional<Eigen::VectorXd> there = problem.residuals(moved);
    if (!there) return;
    differences.col(i) = (*there - here) / step;
  }
  const double difference_s = difference_watch.cpu_s();
  fmt::print(
      "  {} residuals by {} unknowns: exact {:.2f} s, forward differences {:.2f} s of processor: {:.0f} "
      "times "
      "faster; largest difference {:.1e} of the largest entry\n",
      exact.rows(), exact.cols(), exact_s, difference_s, difference_s / exact_s,
      (exact - differences).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff());
}

void print_search(const char* whose, const std::vector<StudyParameter>& parameters,
                  const std::vector<double>& values, int iterations, int equilibria, double wall_s,
                  const std::string& reason) {
  fmt::print("  {:<12}", whose);
  for (size_t i = 0; i < parameters.size(); ++i)
    fmt::print(" {} {:.5g} ", parameters[i].name, values[i]);
  fmt::print(" {} iterations, {} equilibria, {:.1f} s wall; {}\n", iterations, equilibria, wall_s, reason);
  std::fflush(stdout);
}

void compare_with_the_papers_search(const std::filesystem::path& file) {
  Study study = read_study(file);
  for (StudyParameter& parameter : study.law.parameters)
    parameter.vary = Variation::whole;
  const Measurement measurement = read_measurement(study);
  const std::vector<StudyParameter>& parameters = study.law.parameters;
  const Stopwatch own_watch;
  const FitRecord own = fit_study(study, measurement, {});
  std::vector<double> values;
  for (const FittedParameter& parameter : own.parameters)
    values.push_back(parameter.value);
  print_search("this program:", parameters, values, own.iterations, own.forward_solves, own_watch.wall_s(),
               own.reason);
  ElasticModel model = make_model(study);
  const EstimatedParameters estimated = estimated_parameters(study, model);
  ElasticMotion motion(std::move(model), estimated.groups);
  const Stopwatch paper_watch;
  const PaperFit paper = fit_as_the_paper(motion, estimated.values, measurement, locator_for(study.specimen));
  print_search("the paper:", parameters, paper.values, paper.iterations, paper.forward_solves,
               paper_watch.wall_s(), paper.reason);
}

/// The heart's parameters as the paper found them.
Study papers_heart(const std::filesystem::path& file) {
  Study study = read_study(file);
  for (const char* value : {"C_kPa=3", "b1=11.09", "b2=1.76", "b3=10"})
    set_start(study, value);
  return study;
}

void bench_table(const std::filesystem::path& file, const std::filesystem::path& kept) {
  const Study study = papers_heart(file);
  const MonteCarloPlan plan{.noise_mm = {0.4, 0.8, 1.6, 3.2},
                            .frames = {1, 3, 5},
                            .repeats = 10,
                            .exact_pressures = true,
                            .grid = TagGrid{}};
  const Stopwatch watch;
  CellFitter fitter(study, read_measurement(study), plan);
  CellsFile cells_file(kept, study, plan);
  const std::vector<Cell> cells = cells_of(plan);
  const size_t parameters = study.law.parameters.size(),
               workers = std::max(1U, std::thread::hardware_concurrency());
  std::vector<size_t> jobs;
  for (size_t job = 0; job < cells.size(); ++job) {
    if (!cells_file.has(cells[job])) jobs.push_back(job);
  }
  run_forked(
      jobs, workers, [&](size_t job) { return row_of(fitter.fit(cells[job]), parameters); },
      [&](size_t, const std::string& row) { cells_file.append(result_of(row, parameters)); });
  const bool from_the_start = jobs.size() == cells.size();
  const std::string wall_text = from_the_start ? targets.at_most(watch.wall_s(), table_s, "{:.0f}")
                                               : fmt::format("{:.0f}", watch.wall_s());
  double seconds = 0;
  for (const CellResult& result : cells_file.results())
    seconds += result.seconds;
  fmt::print(
      "  {} of {} refits of {} points now, {} s wall{} in {} processes; all took {:.0f} s one after "
      "another\n",
      jobs.size(), cells.size(), fitter.points(), wall_text,
      from_the_start ? "" : " (of those that were left)", workers, seconds);
  for (const TableEntry& entry : table_of(plan, study, cells_file.results())) {
    fmt::print("  {:>4} mm  {} frames ", entry.noise_mm, entry.frames);
    for (const ParameterSpread& spread : entry.parameters)
      fmt::print("  {} {:5.2f} % (least possible {:.2f})", spread.name, spread.sd_percent,
                 100 * spread.bound / spread.truth);
    fmt::print("\n");
  }
}

int run(int argc, char** argv) {
  CLI::App app("Estimation: iterations and seconds", "bench_fit");
  std::filesystem::path table, cells = "table1.cells.csv", paper;
  app.add_option("--paper", paper, "a study: its fit by the paper's search, beside ours, and nothing else");
  app.add_option("--table", table, "a ventricle's study: make the paper's Table 1 of it");
  app.add_option("--cells", cells, "keeps the table's refits")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  if (!paper.empty()) {
    compare_with_the_papers_search(paper);
    return 0;
  }
  const Study study = regional_gel();
  const Measurement measurement = read_measurement(study);
  fmt::print(
      "32 values of C1 from the tags of examples/phantom-a, in {:g} s at most (paper: 7 iterations, 2 h on 8 "
      "Power4 processors)\n",
      regional_fit_s);
  bench_estimate(study, measurement);
  fmt::print("Sensitivities of the same problem\n");
  bench_sensitivities(study, measurement);
  bench_command();
  if (!table.empty()) {
    fmt::print("Table 1 of {}, in {:g} s at most\n", table.string(), table_s);
    bench_table(table, cells);
  }
  return static_cast<int>(targets.conclude());
}

}  // namespace
}  // namespace diastole

int main(int argc, char** argv) {
  try {
    return diastole::run(argc, argv);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "bench_fit: %s\n", error.what());
    return static_cast<int>(diastole::ExitCode::bad_input);
  }
}
