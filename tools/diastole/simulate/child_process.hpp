#pragma once
// A helper program that this one starts and is answerable for: it never outlives its owner, not even when the
// owner is killed, and a Ctrl-C at the terminal goes to the owner alone.

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace diastole {

class ChildProcess {
 public:
  /// Starts arguments[0]; its standard error, and what it prints after first_line(), go to `log`.
  /// Throws HardwareError when it cannot be started.
  ChildProcess(const std::vector<std::string>& arguments, std::filesystem::path log);
  ~ChildProcess() { stop(std::chrono::seconds(5)); }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// The first line of its standard output, without the line's end. Throws HardwareError, with what it said
  /// on standard error, when it ends or `timeout` passes before.
  std::string first_line(std::chrono::milliseconds timeout);

  [[nodiscard]] bool running();
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Asks it to end (SIGTERM) and waits; after `timeout` ends it (SIGKILL). Returns its exit code, or 128
  /// plus the signal that ended it.
  int stop(std::chrono::milliseconds timeout);

  /// What it has written to its log so far.
  [[nodiscard]] std::string said() const;

 private:
  bool reap(std::chrono::milliseconds timeout);

  std::string name_;
  std::filesystem::path log_;
  pid_t pid_ = -1;
  int output_ = -1;
  std::optional<int> exit_code_;
};

}  // namespace diastole
