#pragma once
// The pin trace FILE.csv: header time_ns,signal,value, one row a change.

#include <fmt/format.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>

#include "protocol/contract/input_error.hpp"
#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_controller {

class PinTrace {
 public:
  /// Throws InputError when the file cannot be written.
  explicit PinTrace(const std::filesystem::path& path) : path_(path), file_(std::fopen(path.c_str(), "we")) {
    if (!file_) fail(path, errno);
    std::fputs("time_ns,signal,value\n", file_.get());
  }

  void write(const PinEdge& edge) {
    fmt::memory_buffer line;
    fmt::format_to(std::back_inserter(line), "{},{},{}\n", edge.time_ns, pin_name(edge.pin), edge.value);
    std::fwrite(line.data(), 1, line.size(), file_.get());
  }
  /// Flushes; throws InputError if anything could not be written.
  void close() {
    if (!file_) return;
    const bool failed = std::fflush(file_.get()) != 0 || std::ferror(file_.get()) != 0;
    const int error = errno;
    file_.reset();
    if (failed) fail(path_, error);
  }

 private:
  [[noreturn]] static void fail(const std::filesystem::path& path, int error) {
    throw InputError({path.string(), "", fmt::format("cannot be written: {}", std::strerror(error)),
                      "Choose a place with room where you may write."});
  }

  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace diastole::sim_controller
