// `run --shape` and `simulate --shape`: a session, what it teaches, the next one.

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <memory>
#include <span>

#include "estimator/io/whole_file.hpp"
#include "estimator/report/page.hpp"
#include "host/cli/session_series.hpp"
#include "host/cli/session_view.hpp"
#include "host/runfile/output_guard.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/diastole/commands.hpp"
#include "tools/diastole/shape/drive_file.hpp"
#include "tools/diastole/shape/shape_options.hpp"

namespace diastole {
namespace shaping {

void add_request_to(CLI::App& command, ShapeRequest& request) {
  command.add_option("--study", request.study,
                     "study of rig and specimen, as `explain` wrote it (.study.toml)");
  command.add_option("--rig", request.rig,
                     "rig file whose limits hold, instead of those of the study's first run");
  command.add_option("--period-s", request.wanted.period_s, "of a curve that is given by phase")
      ->check(positive_number);
  command.add_option("--stroke-mL", request.wanted.stroke_mL, "of a curve that is given by fraction")
      ->check(positive_number);
  command
      .add_option("--least", request.wanted.least,
                  "what the curve's lowest point stands for: mL since rest, or kPa")
      ->capture_default_str();
  command
      .add_option("--tolerance-percent", request.tolerance_percent,
                  "NRMSE up to which the specimen follows the curve; exit code 1 beyond it")
      ->capture_default_str()
      ->check(positive_number);
  command.add_option("--cycles", request.plan.cycles, "of a run, the first three of which set in")
      ->capture_default_str()
      ->check(number_between(1, 1000));
}

namespace {

namespace fs = std::filesystem;

constexpr size_t most_iterations = 20;

/// followed.run.h5 -> followed.2 and an ending.
fs::path numbered(const fs::path& output, size_t number, const std::string& ending) {
  std::string name = output.filename().string();
  constexpr std::string_view of_runs = ".run.h5";
  if (name.ends_with(of_runs)) name.resize(name.size() - of_runs.size());
  return output.parent_path() / (number > 0 ? fmt::format("{}.{}{}", name, number, ending) : name + ending);
}

class ShapeSeries final : public SessionSeries {
 public:
  void add_options(CLI::App& command) override {
    CLI::Option* const shape =
        command.add_option("--shape", request_.wanted.file,
                           "curve that the specimen is to follow (diastole shape), instead of an experiment");
    const size_t before = command.get_options().size();
    add_request_to(command, request_);
    command.add_option("--iterations", iterations_, "sessions at the most")
        ->check(number_between(size_t{1}, most_iterations))
        ->capture_default_str();
    command.add_option("--page", page_, "HTML page with the plots of each iteration");
    const std::vector<CLI::Option*> all = command.get_options();
    for (CLI::Option* option : std::span(all).subspan(before))
      option->needs(shape);  // a session of an experiment has no use for it
  }
  [[nodiscard]] bool asked() const override { return !request_.wanted.file.empty(); }
  ExitCode carry_out(const std::string& output, bool force, const Connect& connect,
                     const CommandOutput& out) override;

 private:
  void check_outputs(const fs::path& output, bool force) const;
  static void remove_earlier(const fs::path& output);
  /// Sessions until there is nothing to learn; the last one's exit code.
  ExitCode learn_from_runs(const Shaper& shaper, Shaping& shaping, const fs::path& output,
                           const Acquire& acquire, const CommandOutput& out);
  /// A session with this drive.
  SessionResult run_once(const Shaping& shaping, const fs::path& output, const Acquire& acquire);

  ShapeRequest request_;
  size_t iterations_ = 4;
  fs::path page_;
  std::vector<fs::path> runs_;
};

/// What went wrong in a session that ended by itself.
std::string faults_of(const SessionResult& result) {
  return fmt::format("{} errors noted, {} samples missing, {} triggers in {} cycles", result.errors,
                     result.gaps, result.triggers, result.cycles);
}

void ShapeSeries::check_outputs(const fs::path& output, bool force) const {
  if (request_.study.empty())
    throw InputError({"", "option --study", "is missing", "Name the study of rig and specimen."});
  std::vector<fs::path> inputs{request_.wanted.file, request_.study};
  std::ranges::copy(read_study(request_.study).data.runs, std::back_inserter(inputs));
  for (size_t i = 1; i <= (force ? most_iterations : iterations_); ++i) {
    check_output(numbered(output, i, ".run.h5").string(), force, inputs);
    for (const char* ending : {".csv", ".experiment.toml"})
      require_output({numbered(output, i, ending), inputs, "diastole shape", force});
  }
  if (!page_.empty()) require_output({page_, inputs, report::page_mark, force});
}

/// Precondition: check_outputs() with force. Of a longer series before this one nothing stays that looks like this one's.
void ShapeSeries::remove_earlier(const fs::path& output) {
  for (size_t i = 1; i <= most_iterations; ++i)
    for (const char* ending : {".experiment.toml", ".csv", ".run.h5"})
      fs::remove(numbered(output, i, ending));
}

SessionResult ShapeSeries::run_once(const Shaping& shaping, const fs::path& output, const Acquire& acquire) {
  const size_t number = runs_.size() + 1;
  const fs::path drive = numbered(output, number, ".csv"),
                 experiment = numbered(output, number, ".experiment.toml");
  const fs::path run = numbered(output, number, ".run.h5");
  fs::remove(experiment);  // which would play other points
  write_whole_file(drive, points_text(shaping.cycle, request_.wanted.file.filename().string()));
  write_whole_file(experiment, experiment_text(shaping.cycle, request_.plan, drive.filename().string()));
  SessionResult result = acquire(experiment.string(), run.string());
  runs_.push_back(run);
  return result;
}

ExitCode ShapeSeries::learn_from_runs(const Shaper& shaper, Shaping& shaping, const fs::path& output,
                                      const Acquire& acquire, const CommandOutput& out) {
  std::string end;
  ExitCode code = ExitCode::done;
  while (runs_.size() < iterations_ && shaping.lesson.ending == Ending::none) {
    require_playable(shaping);
    const SessionResult result = run_once(shaping, output, acquire);
    code = exit_code_of(result);
    if (!result.regular || result.end != "completed") end = result.end;
    if (end.empty() && code != ExitCode::done) end = faults_of(result);
    if (!end.empty()) break;
    shaping = shaper.after(runs_);
    if (!out.json) fmt::print("{}\n", shaping_words(shaping));
  }
  if (!end.empty())
    fmt::print(stderr, "The last session did not end as planned ({}): learning stops.\n", end);
  return code;
}

ExitCode ShapeSeries::carry_out(const std::string& output, bool force, const Connect& connect,
                                const CommandOutput& out) {
  check_outputs(output, force);
  fmt::print(stderr, "Solving the specimen and inverting the rig's model.\n");
  const Shaper shaper(request_);
  Shaping shaping = shaper.after({});
  require_playable(shaping);
  ExitCode code = ExitCode::negative;
  if (shaper.is_within_tolerance(shaping.drive)) {
    const Acquire acquire = connect();
    if (force) remove_earlier(output);
    code = learn_from_runs(shaper, shaping, output, acquire, out);
  } else {
    fmt::print(stderr, "{}Nothing was run.\n",
               shaper.miss_in_words("the nearest drive by the model", shaping.drive));
  }
  const bool is_within = shaping.lesson.best && shaper.is_within_tolerance(shaping.seen);
  const bool is_missed = shaping.lesson.best && !is_within;
  const bool is_changed = shaping.lesson.ending == Ending::changed;
  if (is_missed || is_changed) code = std::max(code, ExitCode::negative);
  if (!page_.empty()) write_whole_file(page_, shaping_page(shaping, shaper.wanted_mL(), shaper.target()));
  if (is_missed) fmt::print(stderr, "{}", shaper.miss_in_words("the best drive that was run", shaping.seen));
  if (out.json) {
    Json document = shaping_json(shaping);
    document["tolerance"] = shaper.tolerance();
    document["level_tolerance_mL"] = shaper.level_tolerance_mL(shaping.seen);
    document["followed"] = is_within && !is_changed;
    document["runs"] = Json::array();
    for (const fs::path& run : runs_)
      document["runs"].push_back(run.string());
    const auto best = [&](const char* ending) {
      return shaping.lesson.best ? Json(numbered(output, *shaping.lesson.best + 1, ending).string()) : Json();
    };
    document["drive"] = best(".csv");
    document["experiment"] = best(".experiment.toml");
    document["page"] = page_.empty() ? Json() : Json(page_.string());
    std::cout << json_text(document, 2) << '\n';
  }
  return code;
}

}  // namespace
}  // namespace shaping

std::shared_ptr<SessionSeries> make_shape_series() { return std::make_shared<shaping::ShapeSeries>(); }

}  // namespace diastole
