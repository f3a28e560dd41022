#include "tools/sim_controller/pin_trace.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>

#include "protocol/contract/input_error.hpp"

namespace diastole::sim_controller {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, int error) {
  throw InputError({path.string(), "", fmt::format("cannot be written: {}", std::strerror(error)),
                    "Choose a place with room where you may write."});
}

}  // namespace

PinTrace::PinTrace(const std::filesystem::path& path) : path_(path), file_(std::fopen(path.c_str(), "we")) {
  if (!file_) fail(path, errno);
  std::fputs("time_ns,signal,value\n", file_.get());
}

void PinTrace::write(const PinEdge& edge) {
  fmt::memory_buffer line;
  fmt::format_to(std::back_inserter(line), "{},{},{}\n", edge.time_ns, pin_name(edge.pin), edge.value);
  std::fwrite(line.data(), 1, line.size(), file_.get());
}

void PinTrace::close() {
  if (!file_) return;
  const bool failed = std::fflush(file_.get()) != 0 || std::ferror(file_.get()) != 0;
  const int error = errno;
  file_.reset();
  if (failed) fail(path_, error);
}

}  // namespace diastole::sim_controller
