#include "tools/diastole/simulate/child_process.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using SteadyClock = std::chrono::steady_clock;

[[noreturn]] void become(std::vector<char*> arguments, int output, int log, pid_t parent) {
  ::setpgid(0, 0);
  ::prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (::getppid() != parent) ::_exit(1);  // the owner ended before it could be tied to it
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  std::signal(SIGINT, SIG_DFL);
  std::signal(SIGPIPE, SIG_IGN);
  ::dup2(output, STDOUT_FILENO);
  ::dup2(log, STDERR_FILENO);
  ::execv(arguments[0], arguments.data());
  ::_exit(127);
}

std::vector<char*> argument_pointers(const std::vector<std::string>& arguments) {
  std::vector<char*> pointers;
  for (const std::string& argument : arguments)
    pointers.push_back(const_cast<char*>(argument.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

ChildProcess::ChildProcess(const std::vector<std::string>& arguments, std::filesystem::path log)
    : name_(std::filesystem::path(arguments.at(0)).filename()), log_(std::move(log)) {
  if (::access(arguments[0].c_str(), X_OK) != 0) {
    throw HardwareError(arguments[0], "the program is not there",
                        "Build or install all of Diastole's programs.");
  }
  const int log_file = ::open(log_.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0600);
  std::array<int, 2> output{-1, -1};
  if (log_file < 0 || ::pipe2(output.data(), O_CLOEXEC) != 0) {
    throw HardwareError(name_, fmt::format("cannot be started: {}", std::strerror(errno)),
                        "Check the room and the rights in the directory for temporary files.");
  }
  const std::vector<char*> pointers = argument_pointers(arguments);
  const pid_t parent = ::getpid();
  pid_ = ::fork();
  if (pid_ == 0) become(pointers, output[1], log_file, parent);
  const int error = errno;
  ::close(log_file);
  ::close(output[1]);
  output_ = output[0];
  if (pid_ < 0) {
    ::close(output_);
    throw HardwareError(name_, fmt::format("cannot be started: {}", std::strerror(error)),
                        "Close other programs.");
  }
}

std::string ChildProcess::first_line(std::chrono::milliseconds timeout) {
  const auto give_up = SteadyClock::now() + timeout;
  std::string line;
  while (SteadyClock::now() < give_up) {
    pollfd readable{output_, POLLIN, 0};
    if (::poll(&readable, 1, 50) <= 0) continue;
    char character = 0;
    if (::read(output_, &character, 1) <= 0) break;
    if (character == '\n') return line;
    line += character;
  }
  const std::string words = said();
  throw HardwareError(name_, words.empty() ? "did not become ready" : fmt::format("did not start: {}", words),
                      "Correct what it names; without a reason, try again on a less busy machine.");
}

bool ChildProcess::running() { return pid_ > 0 && !reap(std::chrono::milliseconds(0)); }

int ChildProcess::stop(std::chrono::milliseconds timeout) {
  if (pid_ > 0 && !reap(std::chrono::milliseconds(0))) {
    ::kill(pid_, SIGTERM);
    if (!reap(timeout)) {
      ::kill(pid_, SIGKILL);
      reap(std::chrono::seconds(10));
    }
  }
  if (output_ >= 0) ::close(output_);
  output_ = -1;
  return exit_code_.value_or(128 + SIGKILL);
}

bool ChildProcess::reap(std::chrono::milliseconds timeout) {
  const auto give_up = SteadyClock::now() + timeout;
  while (!exit_code_) {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) {
      exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
    } else if (SteadyClock::now() >= give_up) {
      return false;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  return true;
}

std::string ChildProcess::said() const {
  std::ifstream file(log_);
  std::stringstream text;
  text << file.rdbuf();
  std::string words = text.str();
  while (!words.empty() && words.back() == '\n')
    words.pop_back();
  return words;
}

}  // namespace diastole
