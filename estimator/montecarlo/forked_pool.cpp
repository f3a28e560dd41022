#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <optional>

#include "estimator/montecarlo/worker_pool.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

bool write_all(int file, const void* bytes, size_t size) {
  const char* next = static_cast<const char*>(bytes);
  while (size > 0) {
    const ssize_t written = ::write(file, next, size);
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return false;
    next += written;
    size -= static_cast<size_t>(written);
  }
  return true;
}

bool read_all(int file, void* bytes, size_t size) {
  char* next = static_cast<char*>(bytes);
  while (size > 0) {
    const ssize_t got = ::read(file, next, size);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return false;
    next += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

/// The processors that this process may use, dealt out: worker `number` gets every `workers`-th.
void bind_to_share(size_t number, size_t workers) {
  cpu_set_t allowed, share;
  if (::sched_getaffinity(0, sizeof allowed, &allowed) != 0) return;
  CPU_ZERO(&share);
  const size_t count = static_cast<size_t>(CPU_COUNT(&allowed));
  size_t seen = 0;
  for (size_t cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &allowed)) continue;
    if (seen++ % std::min(workers, count) == number % std::min(workers, count)) CPU_SET(cpu, &share);
  }
  ::sched_setaffinity(0, sizeof share, &share);
}

/// Jobs in, results out, until the jobs' pipe ends.
[[noreturn]] void serve(int jobs, int results, const Work& work) {
  uint64_t job = 0;
  while (read_all(jobs, &job, sizeof job)) {
    std::string result;
    try {
      result = work(job);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "diastole: %s\n", error.what());
      ::_exit(1);
    }
    const uint64_t size = result.size();
    if (!write_all(results, &size, sizeof size) || !write_all(results, result.data(), result.size())) break;
  }
  ::_exit(0);
}

struct Worker {
  pid_t pid;
  int jobs;
  int results;
  std::optional<size_t> busy_with{};
};

class Workers {
 public:
  Workers() = default;
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  ~Workers() {
    for (Worker& worker : workers_) {
      ::close(worker.jobs);
      if (worker.busy_with) ::kill(worker.pid, SIGKILL);
      ::close(worker.results);
      ::waitpid(worker.pid, nullptr, 0);
    }
  }

  void start(size_t number, size_t count, const Work& work) {
    std::array<int, 2> jobs{}, results{};
    if (::pipe(jobs.data()) != 0 || ::pipe(results.data()) != 0) fail(0, std::strerror(errno));
    std::fflush(nullptr);
    const pid_t pid = ::fork();
    if (pid < 0) fail(0, std::strerror(errno));
    if (pid == 0) {
      ::prctl(PR_SET_PDEATHSIG, SIGKILL);
      for (const Worker& other : workers_) {
        ::close(other.jobs);
        ::close(other.results);
      }
      ::close(jobs[1]);
      ::close(results[0]);
      bind_to_share(number, count);
      serve(jobs[0], results[1], work);
    }
    ::close(jobs[0]);
    ::close(results[1]);
    workers_.push_back({pid, jobs[1], results[0]});
  }

  void give(Worker& worker, size_t job) {
    const uint64_t number = job;
    worker.busy_with = job;
    if (!write_all(worker.jobs, &number, sizeof number)) fail(job, "its worker has ended");
  }

  /// Waits for a result; the worker that gave it.
  Worker& take(std::string& result) {
    std::vector<pollfd> files;
    for (const Worker& worker : workers_)
      files.push_back({worker.busy_with ? worker.results : -1, POLLIN, 0});
    while (::poll(files.data(), files.size(), -1) < 0) {
      if (errno != EINTR) fail(0, std::strerror(errno));
    }
    for (size_t i = 0; i < files.size(); ++i) {
      if (files[i].revents == 0) continue;
      uint64_t size = 0;
      if (!read_all(workers_[i].results, &size, sizeof size))
        fail(*workers_[i].busy_with, "its worker has ended");
      result.resize(size);
      if (!read_all(workers_[i].results, result.data(), size))
        fail(*workers_[i].busy_with, "its worker has ended");
      return workers_[i];
    }
    fail(0, "no worker answered");
  }

  std::vector<Worker>& all() { return workers_; }

 private:
  [[noreturn]] static void fail(size_t job, const std::string& problem) {
    throw InputError(
        {"", fmt::format("job {}", job), problem,
         "Give the same command again: what is done is kept. Fewer --workers need less memory."});
  }

  std::vector<Worker> workers_;
};

}  // namespace

void run_forked(const std::vector<size_t>& jobs, size_t workers, const Work& work, const TakeResult& take) {
  if (workers <= 1 || jobs.size() <= 1) {
    for (const size_t job : jobs)
      take(job, work(job));
    return;
  }
  const size_t count = std::min(workers, jobs.size());
  Workers pool;
  for (size_t number = 0; number < count; ++number)
    pool.start(number, count, work);
  size_t next = 0;
  for (Worker& worker : pool.all())
    pool.give(worker, jobs[next++]);
  for (size_t received = 0; received < jobs.size(); ++received) {
    std::string result;
    Worker& worker = pool.take(result);
    const size_t job = *worker.busy_with;
    worker.busy_with.reset();
    if (next < jobs.size()) pool.give(worker, jobs[next++]);
    take(job, result);
  }
}

}  // namespace diastole
