#include "tests/flow/programs.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

namespace diastole::flow {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

std::string text_of(const fs::path& path) {
  std::ifstream file(path);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace

Workplace::Workplace() {
  std::string pattern = (fs::temp_directory_path() / "flow_XXXXXX").string();
  path_ = ::mkdtemp(pattern.data());
  fs::create_directory(temporary());
}

Workplace::~Workplace() { fs::remove_all(path_); }

std::string Workplace::write(const std::string& name, const std::string& text) const {
  std::ofstream(path_ / name) << text;
  return name;
}

nlohmann::json Ended::json() const {
  auto document = nlohmann::json::parse(out, nullptr, false);
  EXPECT_FALSE(document.is_discarded()) << "standard output is no JSON document: " << out << "\n" << err;
  return document.is_discarded() ? nlohmann::json() : document;
}

Program::Program(const Workplace& workplace, const std::vector<std::string>& arguments) {
  static std::atomic<int> number{0};
  const std::string tag = std::to_string(++number);
  out_ = workplace / ("out-" + tag);
  err_ = workplace / ("err-" + tag);
  const std::string program =
      arguments[0].starts_with('/') ? arguments[0] : std::string(DIASTOLE_BIN_DIR "/") + arguments[0];
  std::vector<char*> pointers;
  for (const std::string& argument : arguments)
    pointers.push_back(const_cast<char*>(argument.c_str()));
  pointers.push_back(nullptr);
  const std::string temporary = workplace.temporary();
  pid_ = ::fork();
  if (pid_ != 0) return;
  ::setpgid(0, 0);
  if (::chdir(workplace.path().c_str()) != 0) ::_exit(126);
  ::setenv("TMPDIR", temporary.c_str(), 1);
  ::dup2(::open(out_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDOUT_FILENO);
  ::dup2(::open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600), STDERR_FILENO);
  ::execv(program.c_str(), pointers.data());
  ::_exit(127);
}

Program::~Program() {
  if (!ended()) {
    signal(SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
}

void Program::signal(int number) const {
  if (pid_ > 0) ::kill(pid_, number);  // kill(-1, ...) would reach every process of the machine
}

bool Program::ended() {
  if (pid_ < 0) return true;
  int status = 0;
  if (::waitpid(pid_, &status, WNOHANG) != pid_) return false;
  exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  pid_ = -1;
  return true;
}

bool Program::wait_for_text(const std::string& text) {
  for (const auto end = std::chrono::steady_clock::now() + 60s; std::chrono::steady_clock::now() < end;) {
    const bool over = ended();
    if (out().find(text) != std::string::npos || err().find(text) != std::string::npos) return true;
    if (over) return false;
    std::this_thread::sleep_for(5ms);
  }
  return false;
}

std::string Program::out() const { return text_of(out_); }
std::string Program::err() const { return text_of(err_); }

Ended Program::wait() {
  const auto end = std::chrono::steady_clock::now() + 120s;
  while (!ended()) {
    if (std::chrono::steady_clock::now() > end) {
      ADD_FAILURE() << "killed after two minutes";
      signal(SIGKILL);
    }
    std::this_thread::sleep_for(2ms);
  }
  return {exit_code_, out(), err()};
}

Ended run(const Workplace& workplace, const std::vector<std::string>& arguments) {
  return Program(workplace, arguments).wait();
}

Ended run_line(const Workplace& workplace, const std::string& line) {
  return run(workplace, {"/bin/bash", "-c", "PATH=" DIASTOLE_BIN_DIR ":$PATH; " + line});
}

std::string source_text(const std::string& path) { return text_of(fs::path(DIASTOLE_SOURCE_DIR) / path); }

std::string with(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "nowhere: " << from;
  if (at == std::string::npos) return text;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << "more than once: " << from;
  return text.replace(at, from.size(), to);
}

std::string with_longest_lease(const std::string& rig_file) {
  return with(rig_file, "baud = 460800\n", "baud = 460800\nlease_ms = 5000\n");
}

}  // namespace diastole::flow
