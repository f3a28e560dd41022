#include "host/daemon/queued_sink.hpp"

#include <fmt/format.h>
#include <spdlog/sinks/base_sink-inl.h>  // the library has it for its own mutexes only
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <utility>

namespace diastole {
namespace {

/// What cannot be written is lost: there is nowhere to tell it.
void write_all(int descriptor, std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) return;
    text.remove_prefix(static_cast<size_t>(written));
  }
}

}  // namespace

QueuedSink::QueuedSink(int descriptor) : descriptor_(descriptor), thread_([this] { write_on(); }) {}

QueuedSink::~QueuedSink() {
  ending_ = true;
  ++changes_;
  changes_.notify_one();
  thread_.join();
}

void QueuedSink::sink_it_(const spdlog::details::log_msg& message) {
  if (lines_.size() >= most_waiting) {
    ++left_out_;
    return;
  }
  spdlog::memory_buf_t text;
  formatter_->format(message, text);
  lines_.emplace_back(text.data(), text.size());
  ++changes_;
  changes_.notify_one();
}

void QueuedSink::write_on() {
  for (;;) {
    const unsigned seen = changes_;
    const bool last = ending_;
    const std::vector<std::string> lines = take();
    for (const std::string& line : lines)
      write_all(descriptor_, line);
    if (!lines.empty()) continue;
    if (last) return;
    changes_.wait(seen);
  }
}

std::vector<std::string> QueuedSink::take() {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> lines = std::exchange(lines_, {});
  if (const size_t count = std::exchange(left_out_, 0); count > 0) {
    const std::string remark =
        fmt::format("{} lines of the log were left out: they came faster than they were read", count);
    spdlog::memory_buf_t text;
    formatter_->format(spdlog::details::log_msg("", spdlog::level::warn, remark), text);
    lines.emplace_back(text.data(), text.size());
  }
  return lines;
}

}  // namespace diastole
