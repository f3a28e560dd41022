#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "estimator/cli/interruption.hpp"
#include "estimator/io/whole_file.hpp"
#include "estimator/report/html_text.hpp"
#include "estimator/report/page.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "protocol/contract/named_members.hpp"
#include "tools/diastole/batch/batch_run.hpp"
#include "tools/diastole/commands.hpp"

namespace diastole {
namespace {

using namespace batch;
using nlohmann::ordered_json;
namespace fs = std::filesystem;

struct BatchOptions {
  fs::path file;
  fs::path page;
  fs::path slurm;
  bool force = false;
  std::optional<size_t> only;
  size_t at_once = std::max(1U, std::thread::hardware_concurrency());
};

size_t count_of(const std::vector<JobEnd>& ends, JobState state) {
  return static_cast<size_t>(std::ranges::count(ends, state, &JobEnd::state));
}

/// One line, rewritten in a terminal, else one every so often once it has lasted.
class BatchProgress {
 public:
  void show(const std::vector<JobEnd>& ends, size_t running) {
    const auto now = std::chrono::steady_clock::now();
    const bool terminal = ::isatty(STDERR_FILENO) == 1;
    if (!terminal && now < next_) return;
    next_ = now + std::chrono::seconds(2);
    const size_t waiting = count_of(ends, JobState::waiting);
    fmt::print(stderr, "{}batch: {} of {} ended, {} failed, {} running{}", terminal ? "\r\033[K" : "",
               ends.size() - waiting, ends.size(), count_of(ends, JobState::failed), running,
               terminal && waiting > 0 ? "" : "\n");
    std::fflush(stderr);
  }

 private:
  std::chrono::steady_clock::time_point next_ = std::chrono::steady_clock::now() + std::chrono::seconds(2);
};

std::string batch_page(const Batch& batch, const std::vector<JobEnd>& ends) {
  report::Page page("Batch " + batch.file.filename().string());
  page.headline("Jobs", std::to_string(ends.size()),
                fmt::format("{} done, {} with a negative answer, {} failed, {} waiting",
                            count_of(ends, JobState::done), count_of(ends, JobState::negative),
                            count_of(ends, JobState::failed), count_of(ends, JobState::waiting)));
  page.section("Results", fmt::format("Documents and logs are in {}.", batch.output.string()));
  std::vector<report::Page::Row> rows;
  for (size_t i = 0; i < ends.size(); ++i) {
    rows.push_back(
        {batch.jobs[i].name, ends[i].state == JobState::waiting ? "" : report::number(ends[i].seconds, 3),
         word_of(ends[i].state), ends[i].state == JobState::failed ? ends[i].message : ends[i].result});
  }
  page.table({"job", "seconds", "state", "result"}, rows, "A negative answer is one: exit code 1.", 2);
  return page.html();
}

void print_table(const Batch& batch, const std::vector<JobEnd>& ends) {
  size_t width = 3;
  for (const Job& job : batch.jobs)
    width = std::max(width, job.name.size());
  fmt::print("{:>4}  {:<{}}  {:<8}  {:>8}  result\n", "", "job", width, "state", "seconds");
  for (size_t i = 0; i < ends.size(); ++i) {
    std::string words = ends[i].state == JobState::failed ? ends[i].message : ends[i].result;
    std::ranges::replace(words, '\n', ' ');
    fmt::print("{:>4}  {:<{}}  {:<8}  {:>8.1f}  {}\n", i + 1, batch.jobs[i].name, width,
               word_of(ends[i].state), ends[i].seconds, words);
  }
  fmt::print("{} of {} ended, {} failed; documents and logs are in {}\n",
             ends.size() - count_of(ends, JobState::waiting), ends.size(), count_of(ends, JobState::failed),
             batch.output.string());
}

void print_json(const Batch& batch, const std::vector<JobEnd>& ends) {
  ordered_json jobs = ordered_json::array();
  for (size_t i = 0; i < ends.size(); ++i) {
    const Job& job = batch.jobs[i];
    const bool has_document = ends[i].state == JobState::done || ends[i].state == JobState::negative;
    const fs::path document = batch.output / (job.name + ".json");
    jobs.push_back({DIASTOLE_NAMED(job, name, command),
                    {"input", job.input.string()},
                    {"state", word_of(ends[i].state)},
                    DIASTOLE_NAMED(ends[i], exit_code, seconds, result, message),
                    {"document", has_document ? ordered_json(document.string()) : ordered_json(nullptr)}});
  }
  const ordered_json json{{"file", batch.file.string()},
                          {"output", batch.output.string()},
                          {"done", count_of(ends, JobState::done)},
                          {"negative", count_of(ends, JobState::negative)},
                          {"failed", count_of(ends, JobState::failed)},
                          {"waiting", count_of(ends, JobState::waiting)},
                          {"jobs", jobs}};
  std::cout << json_text(json, 1) << '\n';
}

ExitCode run(const BatchOptions& options, const CommandOutput& out) {
  const Batch batch = read_batch(options.file);
  if (options.only && (*options.only == 0 || *options.only > batch.jobs.size())) {
    throw InputError({batch.file.string(), "", fmt::format("there is no job {}", *options.only),
                      fmt::format("Jobs are counted from 1 to {}.", batch.jobs.size())});
  }
  if (!options.page.empty()) require_output({options.page, {options.file}, report::page_mark, options.force});
  const std::string program = fs::read_symlink("/proc/self/exe").string();
  std::vector<JobEnd> ends;
  if (!options.slurm.empty()) {
    require_output({options.slurm, {options.file}, "#SBATCH", options.force});
    write_whole_file(options.slurm, slurm_script(batch, program));
    for (const Job& job : batch.jobs)
      ends.push_back(remembered(batch, job));
  } else {
    const Interruption interruption;
    BatchProgress progress;
    RunOptions how{program, options.at_once};
    if (options.only) how.only = *options.only - 1;
    how.interrupted = [] { return Interruption::requested(); };
    how.on_change = [&](const std::vector<JobEnd>& now, size_t running) { progress.show(now, running); };
    ends = run_batch(batch, how);
    if (Interruption::requested()) fmt::print(stderr, "Stopped on request; the same command goes on.\n");
  }
  if (!options.page.empty()) write_whole_file(options.page, batch_page(batch, ends));
  if (out.json) {
    print_json(batch, ends);
  } else if (!options.slurm.empty()) {
    fmt::print("{} tasks in {}: sbatch {}\n", batch.jobs.size(), options.slurm.string(),
               options.slurm.string());
  } else {
    print_table(batch, ends);
  }
  if (!options.slurm.empty()) return ExitCode::done;
  const auto is_good = [](const JobEnd& end) {
    return end.state == JobState::done || end.state == JobState::negative;
  };
  const bool good = options.only ? is_good(ends[*options.only - 1]) : std::ranges::all_of(ends, is_good);
  return good ? ExitCode::done : ExitCode::negative;
}

}  // namespace

void add_batch(CommandLine& line) {
  auto options = std::make_shared<BatchOptions>();
  CLI::App* command =
      line.add("batch", "fit, explain, montecarlo or track on many studies, on all processors",
               "  diastole batch gels.batch.toml\n"
               "      runs what has not ended yet; the same command again goes on where it was stopped\n"
               "  diastole batch gels.batch.toml --at-once 4 -o gels.html --json\n"
               "  diastole batch gels.batch.toml --slurm gels.sh\n"
               "      writes a script for sbatch, an array with one task a job\n"
               "  diastole batch gels.batch.toml --only 3\n\n"
               "gels.batch.toml:\n"
               "  format = \"diastole-batch\"\n"
               "  version = 1\n"
               "  output = \"results\"\n"
               "  [[job]]\n"
               "  command = \"fit\"                  # fit, explain, montecarlo, track\n"
               "  inputs = [\"gels/*.study.toml\"]   # image folders for track\n"
               "  arguments = [\"--mesh\", \"8,4,1\"]");
  command->add_option("JOBS", options->file, "batch file (*.batch.toml)")->required();
  command->add_option("--at-once", options->at_once, "jobs at the same time")
      ->check(positive_number)
      ->capture_default_str();
  command->add_option("--only", options->only, "this job alone, counted from 1");
  command->add_option("--slurm", options->slurm, "write a script for sbatch instead of running anything");
  command->add_option("-o,--output", options->page, "a page with the table, to write");
  command->add_flag("--force", options->force, "replace an output file that is of another kind");
  line.on_run(command, [options](const CommandOutput& out) { return run(*options, out); });
}

}  // namespace diastole
