#pragma once
// Whole programs under test: run one to its end, or keep a session's helpers running, in a directory of one's
// own.

#include <filesystem>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace diastole::flow {

/// A directory that is gone afterwards; programs started by run() have it as working directory and TMPDIR
/// lies in it.
class Workplace {
 public:
  Workplace();
  ~Workplace();
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;

  [[nodiscard]] std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  /// Where programs put temporary files; must be empty when they have ended.
  [[nodiscard]] std::filesystem::path temporary() const { return path_ / "tmp"; }
  /// Writes a file and returns its name.
  std::string write(const std::string& name, const std::string& text) const;

 private:
  std::filesystem::path path_;
};

struct Ended {
  int exit_code = -1;  ///< or 128 plus the signal
  std::string out;
  std::string err;
  [[nodiscard]] nlohmann::json json() const;  ///< `out` as JSON; a failed expectation and null if it is none
};

/// A started program of build/.../bin (or an absolute path).
class Program {
 public:
  Program(const Workplace& workplace, const std::vector<std::string>& arguments);
  ~Program();
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  void signal(int number) const;
  [[nodiscard]] pid_t pid() const { return pid_; }  ///< -1 when it has ended
  /// Waits until its standard output or error holds `text`; false when it ends or a minute passes before.
  bool wait_for_text(const std::string& text);
  [[nodiscard]] std::string out() const;
  [[nodiscard]] std::string err() const;
  /// Waits for its end; kills it after two minutes.
  Ended wait();

 private:
  bool ended();
  std::filesystem::path out_, err_;
  pid_t pid_ = -1;
  int exit_code_ = -1;
};

Ended run(const Workplace& workplace, const std::vector<std::string>& arguments);

/// Runs a line of bash, which finds the programs by their names.
Ended run_line(const Workplace& workplace, const std::string& line);

/// The text of a file of the source tree.
std::string source_text(const std::string& path);
/// `text` with the only occurrence of `from` replaced; a failed expectation if there is none or another.
std::string with(std::string text, const std::string& from, const std::string& to);
/// A rig file like the example's with the longest lease: for real time, where a machine that is busy with other tests
/// must not cost the controller its lease.
std::string with_longest_lease(const std::string& rig_file);

}  // namespace diastole::flow
