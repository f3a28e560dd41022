#include "tools/benchmarks/timed_process.hpp"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <system_error>

namespace diastole {
namespace {

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

/// This process's environment, with one thread for every numerical library.
std::vector<std::string> one_thread_environment() {
  std::vector<std::string> variables{"OMP_NUM_THREADS=1", "OPENBLAS_NUM_THREADS=1",
                                     "CCX_NPROC_EQUATION_SOLVER=1"};
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (std::strstr(*variable, "_NUM_THREADS=") == nullptr) variables.emplace_back(*variable);
  }
  return variables;
}

std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts)
    pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

ProcessCost run_timed(const std::vector<std::string>& command, const std::filesystem::path& folder,
                      const std::filesystem::path& log) {
  std::vector<std::string> arguments = command;
  std::vector<std::string> variables = one_thread_environment();
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  posix_spawn_file_actions_addchdir_np(&actions, folder.c_str());
  const auto begun = std::chrono::steady_clock::now();
  pid_t child = 0;
  const int error = posix_spawnp(&child, arguments[0].c_str(), &actions, nullptr,
                                 pointers_to(arguments).data(), pointers_to(variables).data());
  posix_spawn_file_actions_destroy(&actions);
  if (error == ENOENT) return {};
  if (error != 0) throw std::system_error(error, std::generic_category(), arguments[0]);
  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  ProcessCost figures;
  figures.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  figures.processor_s = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  figures.peak_MB = static_cast<double>(usage.ru_maxrss) / 1024.0;
  if (WIFEXITED(status)) figures.exit_code = WEXITSTATUS(status);
  return figures;
}

}  // namespace diastole
