#pragma once
// The pin trace FILE.csv: header time_ns,signal,value, one row a change.

#include <cstdio>
#include <filesystem>
#include <memory>

#include "tools/sim_controller/simulated_controller.hpp"

namespace diastole::sim_controller {

class PinTrace {
 public:
  /// Throws InputError when the file cannot be written.
  explicit PinTrace(const std::filesystem::path& path);

  void write(const PinEdge& edge);
  /// Flushes; throws InputError if anything could not be written.
  void close();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::filesystem::path path_;
  std::unique_ptr<std::FILE, Close> file_;
};

}  // namespace diastole::sim_controller
