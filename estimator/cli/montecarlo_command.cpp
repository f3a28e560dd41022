#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <optional>
#include <thread>

#include "estimator/cli/commands.hpp"
#include "estimator/cli/study_images.hpp"
#include "estimator/cli/study_options.hpp"
#include "estimator/fit/study_fit.hpp"
#include "estimator/io/member_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/montecarlo/cells_file.hpp"
#include "estimator/montecarlo/montecarlo.hpp"
#include "estimator/montecarlo/worker_pool.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"

namespace diastole {

DIASTOLE_MEMBERS(ParameterSpread, truth, mean, sd, sd_percent, ci95, mean_se, coverage, bound)

namespace {

struct MonteCarloArguments {
  StudyOptions study;  ///< with the true values
  std::vector<double> noise_mm;
  std::vector<int> frames;
  std::vector<double> grid_mm;
  std::filesystem::path at;
  std::optional<std::filesystem::path> cells;
  int repeats = 10;
  unsigned seed = 1;
  bool exact_pressures = false;
  size_t workers = 0;
};

void set_truth(Study& study, const FitRecord& fit, const std::string& file) {
  for (StudyParameter& parameter : study.law.parameters) {
    const auto found =
        std::find_if(fit.parameters.begin(), fit.parameters.end(),
                     [&](const FittedParameter& fitted) { return fitted.name == parameter.name; });
    if (found == fit.parameters.end()) {
      throw InputError({file, "key parameters", fmt::format("has no {}", parameter.name),
                        "Give a fit of the same study."});
    }
    parameter.start = std::clamp(found->value, parameter.lower, parameter.upper);
  }
}

/// What the synthetic data are made with: values given, those of an earlier fit, or those of a fit now.
void choose_truth(Study& study, const Measurement& measurement, const MonteCarloArguments& arguments) {
  if (!arguments.at.empty()) {
    set_truth(study, fit_record_from_json(read_whole_file(arguments.at), arguments.at.string()),
              arguments.at.string());
  } else if (arguments.study.starts.empty()) {
    StudyFitOptions options;
    options.unload = arguments.study.unload;
    const FitRecord fit = fit_study(study, measurement, options);
    if (!fit.converged || fit.parameters.empty()) {
      throw InputError({study.file.string(), "", fmt::format("cannot be fitted: {}", fit.reason),
                        "Give the true values with --set NAME=NUMBER."});
    }
    set_truth(study, fit, study.file.string());
  }
}

std::string noise_words(double noise_mm) {
  return noise_mm > 0 ? fmt::format("{:g} mm", noise_mm) : "as stated";
}

class Progress {
 public:
  Progress(size_t cells, bool shown) : cells_(cells), shown_(shown) {}

  void report(const CellResult& result, const Study& study) {
    ++done_;
    if (!shown_) return;
    std::string values = result.converged ? "" : "  did not converge";
    for (size_t i = 0; i < result.value.size(); ++i)
      values += fmt::format("  {} {:.4g}", study.law.parameters[i].name, result.value[i]);
    const double left_s =
        seconds_since(begun_) / static_cast<double>(done_) * static_cast<double>(cells_ - done_);
    fmt::print(stderr, "  {:>4} of {}: noise {}, {} frames, repeat {}:{}   about {:.0f} s left\n", done_,
               cells_, noise_words(result.cell.noise_mm), result.cell.frames, result.cell.repeat, values,
               left_s);
  }

 private:
  size_t cells_;
  bool shown_;
  Clock::time_point begun_ = Clock::now();
  size_t done_ = 0;
};

Json from_entry(const TableEntry& entry) {
  Json json{{"noise_mm", entry.noise_mm > 0 ? Json(entry.noise_mm) : Json(nullptr)},
            DIASTOLE_NAMED(entry, frames, refits, failed)};
  json["parameters"] = written(by_name(entry.parameters));
  return json;
}

void print_json(const std::vector<TableEntry>& table, const Study& study, const MonteCarloPlan& plan,
                double seconds, size_t processes) {
  Json json{{"study", study.file.string()},
            DIASTOLE_NAMED(plan, repeats, seed, exact_pressures),
            {"seconds", seconds},
            {"processes", processes}};
  json["parameters"] = from_entry(table.front())["parameters"];
  json["cells"] = Json::array();
  for (const TableEntry& entry : table)
    json["cells"].push_back(from_entry(entry));
  std::cout << json_text(json, 1) << '\n';
}

/// Below an entry: what no unbiased estimator can go below, and the paper's entry where the law is the paper's.
void print_beside(const TableEntry& entry, const Study& study) {
  fmt::print("  {:26}", "  least possible");
  for (const ParameterSpread& spread : entry.parameters)
    fmt::print("  {:>9.2f}", 100 * spread.bound / spread.truth);
  fmt::print("\n");
  const auto cells =
      study.law.name == "guccione" ? paper_sd_percent(entry.noise_mm, entry.frames) : std::nullopt;
  if (!cells) return;
  fmt::print("  {:26}  {:>9g}\n", "  the paper's", fmt::join(*cells, "  "));
}

void print_table(const std::vector<TableEntry>& table, const Study& study) {
  fmt::print("Standard deviations of the refitted parameters, in % of their mean\n\n");
  fmt::print("  noise       frames  refits");
  for (const StudyParameter& parameter : study.law.parameters)
    fmt::print("  {:>9}", parameter.name);
  fmt::print("\n");
  for (const TableEntry& entry : table) {
    fmt::print("  {:<10}  {:>6}  {:>6}", noise_words(entry.noise_mm), entry.frames, entry.refits);
    for (const ParameterSpread& spread : entry.parameters)
      fmt::print("  {:>9.2f}", spread.sd_percent);
    fmt::print("{}\n", entry.failed > 0 ? fmt::format("   {} did not converge", entry.failed) : "");
    print_beside(entry, study);
  }
  fmt::print(
      "\n'least possible' is the Cramér–Rao bound of these points: no unbiased estimate scatters less.\n\n");
  for (const ParameterSpread& spread : table.front().parameters) {
    fmt::print(
        "At noise {} and {} frames: {} = {:.4g} ± {:.2g} (95 % of the refits within {:.4g} to {:.4g}; truth "
        "{:.4g}; the refits' own standard errors are {:.2g} on average, their intervals hold the truth in "
        "{:.0f} % of the cases).\n",
        noise_words(table.front().noise_mm), table.front().frames, spread.name, spread.mean, spread.sd,
        spread.ci95[0], spread.ci95[1], spread.truth, spread.mean_se, 100 * spread.coverage);
  }
}

size_t workers_for(size_t wanted) {
  return wanted > 0 ? wanted : std::max(1U, std::thread::hardware_concurrency());
}

MonteCarloPlan plan_of(const MonteCarloArguments& arguments, const Measurement& measurement) {
  MonteCarloPlan plan{.noise_mm = arguments.noise_mm,
                      .frames = arguments.frames,
                      .repeats = arguments.repeats,
                      .exact_pressures = arguments.exact_pressures,
                      .seed = arguments.seed,
                      .unload = arguments.study.unload};
  if (plan.noise_mm.empty()) plan.noise_mm = {0.0};
  if (!arguments.grid_mm.empty())
    plan.grid = TagGrid{.stripe_mm = arguments.grid_mm[0], .pixel_mm = arguments.grid_mm[1]};
  if (plan.frames.empty()) plan.frames = {static_cast<int>(measurement.frames.size()) - 1};
  for (const double noise_mm : plan.noise_mm) {
    if (!std::isfinite(noise_mm))
      throw InputError(
          {"", "--noise", "is not a finite number", "Give standard deviations in mm, as 0.4,0.8."});
  }
  return plan;
}

ExitCode run_montecarlo(const MonteCarloArguments& arguments, const CommandOutput& out) {
  std::optional<MpiWorld> world;
  if (in_mpi_world()) world.emplace();
  const bool leads = !world || world->rank() == 0;
  const Clock::time_point begun = Clock::now();
  Study study = read_study(arguments.study);
  if (leads && !arguments.study.unload) remark_on_imaged_load(study, "montecarlo");
  use_images(study);
  const Measurement measurement = read_measurement(study);
  choose_truth(study, measurement, arguments);
  const MonteCarloPlan plan = plan_of(arguments, measurement);
  CellFitter fitter(study, measurement, plan);
  const std::vector<Cell> cells = cells_of(plan);
  const size_t parameters = study.law.parameters.size();
  std::optional<CellsFile> file;
  std::vector<CellResult> results;
  if (leads && arguments.cells) {
    file.emplace(*arguments.cells, study, plan);
    results = file->results();
  }
  std::vector<size_t> jobs;
  for (size_t job = 0; job < cells.size(); ++job) {
    if (!file || !file->has(cells[job])) jobs.push_back(job);
  }
  const size_t processes = world ? static_cast<size_t>(world->size()) : workers_for(arguments.workers);
  if (leads) {
    fmt::print(stderr, "{} refits of {} synthetic points in {} {}{}.\n", jobs.size(), fitter.points(),
               processes, world ? "MPI ranks" : "processes",
               jobs.size() < cells.size()
                   ? fmt::format("; {} more are in {}", cells.size() - jobs.size(), arguments.cells->string())
                   : "");
  }
  Progress progress(jobs.size(), leads);
  const Work work = [&](size_t job) { return row_of(fitter.fit(cells[job]), parameters); };
  const TakeResult take = [&](size_t, const std::string& row) {
    const CellResult result = result_of(row, parameters);
    results.push_back(result);
    if (file) file->append(result);
    progress.report(result, study);
  };
  if (world) {
    world->run(jobs, work, take);
  } else {
    run_forked(jobs, processes, work, take);
  }
  if (!leads) return ExitCode::done;

  const std::vector<TableEntry> table = table_of(plan, study, results);
  const double seconds = seconds_since(begun);
  if (out.json) {
    print_json(table, study, plan, seconds, processes);
  } else {
    print_table(table, study);
  }
  fmt::print(stderr, "{:.1f} s.\n", seconds);
  const bool failed =
      std::any_of(table.begin(), table.end(), [](const TableEntry& entry) { return entry.failed > 0; });
  return failed ? ExitCode::negative : ExitCode::done;
}

}  // namespace

void add_montecarlo(CommandLine& line) {
  auto arguments = std::make_shared<MonteCarloArguments>();
  CLI::App* command = line.add(
      "montecarlo", "how precisely a study tells its parameters: refit synthetic noisy data many times",
      "  diastole montecarlo examples/phantom-a.study.toml --repeats 20\n"
      "  diastole montecarlo lv.study.toml --noise 0.4,0.8,1.6,3.2 --frames 1,3,5 --cells lv.cells.csv\n"
      "  mpirun -n 16 diastole montecarlo lv.study.toml --noise 0.4,0.8 --cells lv.cells.csv\n"
      "The data are those that the study's own points would show at the true values, with normal noise. The "
      "true\n"
      "values are --set, or --at an earlier fit, or else the study is fitted first. With --cells, the same "
      "command\n"
      "goes on after an interruption. Under mpirun or srun the refits are spread over the ranks.");
  add_study(*command, arguments->study);
  add_values(*command, arguments->study);
  add_unloading(*command, arguments->study);
  command
      ->add_option("--noise", arguments->noise_mm,
                   "standard deviations of the points, mm; default: as stated")
      ->delimiter(',')
      ->check(positive_number);
  command->add_option("--frames", arguments->frames, "numbers of loaded frames to use; default: all")
      ->delimiter(',')
      ->check(positive_number);
  command
      ->add_option(
          "--tag-grid", arguments->grid_mm,
          "STRIPE,PIXEL, mm, instead of the study's points: a grid of stripes so far apart in six short-axis "
          "and six long-axis images, a 3-D point a pixel along each stripe, as in the paper")
      ->delimiter(',')
      ->expected(2)
      ->check(number_between(0.05, 100.0));
  command->add_option("--repeats", arguments->repeats, "refits of each noise and number of frames")
      ->check(number_between(2, 100000))
      ->capture_default_str();
  command->add_option("--at", arguments->at, "true values from a result of `diastole fit -o`");
  command->add_flag("--exact-pressures", arguments->exact_pressures,
                    "frame pressures without error, as in the paper's table");
  command->add_option("--seed", arguments->seed, "of the noise")->capture_default_str();
  command->add_option("--workers", arguments->workers, "processes; default: as many as processors");
  command->add_option("--cells", arguments->cells, "append each refit to this file, and go on from it");
  line.on_run(command, [arguments](const CommandOutput& out) { return run_montecarlo(*arguments, out); });
}

}  // namespace diastole
