#include "tools/diastole/batch/batch_run.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/prctl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "estimator/io/whole_file.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::batch {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr const char* record_format = "diastole-job";
constexpr size_t message_lines = 2;  ///< an error's place and its remedy

fs::path file_of(const Batch& batch, const Job& job, const std::string& ending) {
  return batch.output / (job.name + ending);
}

int64_t mtime_ns(const fs::path& path) {
  struct stat state {};
  if (::stat(path.c_str(), &state) != 0) return 0;
  return state.st_mtim.tv_sec * int64_t{1'000'000'000} + state.st_mtim.tv_nsec;
}

json read_json_file(const fs::path& file) {
  if (!fs::exists(file)) return {};
  try {
    return json::parse(read_whole_file(file), no_deeper_than<json>(), false);
  } catch (const JsonTooDeep&) {
    return json::value_t::discarded;
  }
}

std::string fit_words(const json& document) {
  std::vector<std::string> words;
  for (const auto& [name, parameter] : document.at("parameters").items()) {
    if (!parameter.contains("se") || !parameter["se"].is_number() || !parameter["value"].is_number())
      continue;
    words.push_back(fmt::format("{} {:.4g} \u00b1 {:.2g}", name, parameter["value"].get<double>(),
                                parameter["se"].get<double>()));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string explanation_words(const json& document) {
  std::vector<std::string> ids;
  for (const json& effect : document.at("effects"))
    ids.push_back(effect.at("id").get<std::string>());
  return fmt::format("{}{}{}", document.at("verdict").get<std::string>(), ids.empty() ? "" : ": ",
                     fmt::join(ids, ", "));
}

/// The heart of a command's document; empty if it is not as expected.
std::string result_words(const std::string& command, const json& document) {
  try {
    if (command == "fit") return fit_words(document);
    if (command == "explain") return explanation_words(document);
    if (command == "track") return fmt::format("{} points", document.at("points").get<int64_t>());
    return fmt::format("{} cells of {} refits", document.at("cells").size(),
                       document.at("repeats").get<int64_t>());
  } catch (const json::exception&) {
    return {};
  }
}

std::string last_lines(const fs::path& log) {
  std::vector<std::string> lines;
  const std::string text = fs::exists(log) ? read_whole_file(log) : std::string();
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    if (end > from) lines.push_back(text.substr(from, end - from));
    from = end + 1;
  }
  const size_t first = lines.size() - std::min(lines.size(), message_lines);
  return fmt::format("{}", fmt::join(lines.begin() + static_cast<std::ptrdiff_t>(first), lines.end(), "\n"));
}

/// `document`: what the command printed. A negative answer has one; without it the data were refused, or the command was interrupted.
JobState state_of(int exit_code, const fs::path& document) {
  if (exit_code == 0) return JobState::done;
  std::error_code missing;
  const bool has_document = fs::file_size(document, missing) > 0 && !missing;
  return exit_code == 1 && has_document ? JobState::negative : JobState::failed;
}

/// The processors that this process may use.
std::vector<int> processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  std::vector<int> found;
  if (::sched_getaffinity(0, sizeof set, &set) != 0) return found;
  for (int i = 0; i < CPU_SETSIZE; ++i)
    if (CPU_ISSET(i, &set)) found.push_back(i);
  return found;
}

/// In the child, between fork and exec: only what is safe there. Ctrl-C is the batch's, which ends its jobs and ends them too if it
/// is killed. Commands share their loops between the processors that they may use; several jobs share those instead.
[[noreturn]] void become(const std::vector<char*>& arguments, const char* folder, int output, int log,
                         int processor) {
  ::setpgid(0, 0);
  if (::chdir(folder) != 0) ::_exit(127);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (processor >= 0) {
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(processor, &one);
    ::sched_setaffinity(0, sizeof one, &one);
  }
  std::signal(SIGINT, SIG_DFL);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

/// In the folder. The exit code, -1 if a signal ended it; none if it was asked to end.
std::optional<int> run_process(const std::vector<std::string>& line, const fs::path& folder,
                               const fs::path& output, const fs::path& log, int processor,
                               const RunOptions& options) {
  constexpr auto pause = std::chrono::milliseconds(20);
  std::vector<char*> arguments;
  for (const std::string& argument : line)
    arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);
  const int mode = O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC;
  const std::array<int, 2> files{::open(output.c_str(), mode, 0644), ::open(log.c_str(), mode, 0644)};
  const bool open = files[0] >= 0 && files[1] >= 0;
  const pid_t child = open ? ::fork() : -1;
  if (child == 0) become(arguments, folder.c_str(), files[0], files[1], processor);
  const int error = errno;
  for (const int file : files)
    if (file >= 0) ::close(file);
  if (child < 0)
    throw HardwareError(line[0], fmt::format("cannot be started: {}", std::strerror(error)),
                        "Check the disk and the number of processes.");
  bool asked_to_end = false;
  for (int status = 0;; std::this_thread::sleep_for(pause)) {
    if (::waitpid(child, &status, WNOHANG) == child) {
      if (asked_to_end) return std::nullopt;
      return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }
    if (!asked_to_end && options.interrupted && options.interrupted()) {
      asked_to_end = true;
      ::kill(child, SIGTERM);
    }
  }
}

JobEnd run_job(const Batch& batch, const Job& job, int processor, const RunOptions& options) {
  const auto began = std::chrono::steady_clock::now();
  const fs::path document = file_of(batch, job, ".json"),
                 part = file_of(batch, job, fmt::format(".json.{}.part", ::getpid())),
                 log = file_of(batch, job, ".log");
  for (const fs::path& old : {file_of(batch, job, ".job.json"), document})
    fs::remove(old);
  const int64_t input_ns = mtime_ns(job.input);
  std::vector<std::string> line{options.program};
  line.insert(line.end(), job.arguments.begin(), job.arguments.end());
  const std::optional<int> code = run_process(line, batch.file.parent_path(), part, log, processor, options);
  if (!code) {
    fs::remove(part);
    return {};
  }
  JobEnd end{state_of(*code, part),
             *code,
             std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count(),
             {},
             {}};
  if (end.state == JobState::failed) {
    fs::remove(part);
    end.message = last_lines(log);
    if (*code < 0) end.message += end.message.empty() ? "ended by a signal" : "\nended by a signal";
  } else {
    fs::rename(part, document);
    end.result = result_words(job.command, read_json_file(document));
  }
  const json record{{"format", record_format},    {"arguments", job.arguments}, {"input_ns", input_ns},
                    {"exit_code", end.exit_code}, {"seconds", end.seconds},     {"result", end.result},
                    {"message", end.message}};
  write_whole_file(file_of(batch, job, ".job.json"), json_text(record, 1) + "\n");
  return end;
}

/// Until it is destroyed nothing else runs this batch: not the whole beside another whole or beside single jobs, which may run beside
/// each other. Where the file system has no locks (some network ones) nothing is held.
Descriptor hold_batch(const Batch& batch, bool whole) {
  Descriptor folder(::open(batch.output.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (::flock(folder.get(), (whole ? LOCK_EX : LOCK_SH) | LOCK_NB) != 0 && errno == EWOULDBLOCK)
    throw InputError({batch.output.string(), "", "another `diastole batch` works on it",
                      "Wait for its end, or give this batch an output of its own."});
  return folder;
}

std::string quoted(const std::string& text) {
  std::string made = "'";
  for (const char c : text)
    made += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return made + "'";
}

}  // namespace

const char* word_of(JobState state) {
  constexpr std::array<const char*, 4> words{"waiting", "done", "negative", "failed"};
  return words[static_cast<size_t>(state)];
}

JobEnd remembered(const Batch& batch, const Job& job) {
  const json record = read_json_file(file_of(batch, job, ".job.json"));
  if (!record.is_object() || record.value("format", "") != record_format) return {};
  if (record.value("arguments", std::vector<std::string>()) != job.arguments ||
      record.value("input_ns", int64_t{0}) != mtime_ns(job.input))
    return {};
  const int code = record.value("exit_code", -1);
  return {state_of(code, file_of(batch, job, ".json")), code, record.value("seconds", 0.0),
          record.value("result", ""), record.value("message", "")};
}

std::vector<JobEnd> run_batch(const Batch& batch, const RunOptions& options) {
  std::error_code failure;
  fs::create_directories(batch.output, failure);
  if (failure)
    throw InputError({batch.file.string(), "key output",
                      fmt::format("{} cannot be made: {}", batch.output.string(), failure.message()),
                      "Name another folder."});
  const Descriptor held = hold_batch(batch, !options.only);
  std::vector<JobEnd> ends;
  std::vector<size_t> to_do;
  for (size_t i = 0; i < batch.jobs.size(); ++i) {
    ends.push_back(remembered(batch, batch.jobs[i]));
    const bool has_ended = ends.back().state == JobState::done || ends.back().state == JobState::negative;
    if (!has_ended && (!options.only || *options.only == i)) to_do.push_back(i);
  }
  const std::vector<int> cores = processors();
  const size_t slots = std::min(std::max<size_t>(1, options.at_once), to_do.size());
  std::atomic<size_t> next{0};
  std::mutex changing;
  size_t running = 0;
  const auto change = [&](auto&& by) {
    const std::scoped_lock lock(changing);
    by();
    if (options.on_change) options.on_change(ends, running);
  };
  const auto work = [&](size_t slot) {
    const int processor = slots < 2 || cores.empty() ? -1 : cores[slot % cores.size()];
    for (size_t at = next++; at < to_do.size(); at = next++) {
      if (options.interrupted && options.interrupted()) return;
      change([&] { ++running; });
      JobEnd end;
      try {
        end = run_job(batch, batch.jobs[to_do[at]], processor, options);
      } catch (const std::exception& error) {  // no room, no process: the others may go on
        end = {JobState::failed, -1, 0, {}, error.what()};
      }
      change([&] {
        --running;
        ends[to_do[at]] = end;
      });
    }
  };
  std::vector<std::jthread> workers;
  for (size_t slot = 0; slot < slots; ++slot)
    workers.emplace_back(work, slot);
  workers.clear();
  return ends;
}

std::string slurm_script(const Batch& batch, const std::string& program) {
  return fmt::format(
      "#!/bin/bash\n"
      "# {} jobs of {}; sbatch runs each on a processor of its own:\n"
      "#   sbatch THIS_FILE\n"
      "# then gather them, and run again what failed, with\n"
      "#   diastole batch {}\n"
      "#SBATCH --job-name=diastole\n"
      "#SBATCH --array=1-{}\n"
      "#SBATCH --cpus-per-task=1\n"
      "#SBATCH --output=/dev/null\n"
      "set -eu\n"
      "exec {} batch {} --only \"$SLURM_ARRAY_TASK_ID\"\n",
      batch.jobs.size(), batch.file.filename().string(), quoted(batch.file.string()), batch.jobs.size(),
      quoted(program), quoted(batch.file.string()));
}

}  // namespace diastole::batch
