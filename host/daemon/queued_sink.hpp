#pragma once
// A sink of the log that nobody waits for: a thread of its own writes, so that whoever logs (the rig's thread with its
// heart-beat) waits neither for a reader of the log nor for another thread that is just writing. What would wait behind
// `most_waiting` lines is left out, and the log says how many.

#include <fmt/format.h>
#include <spdlog/sinks/base_sink-inl.h>  // the library has it for its own mutexes only
#include <spdlog/sinks/base_sink.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "host/transport/real_time.hpp"

namespace diastole {

class QueuedSink final : public spdlog::sinks::base_sink<InheritingMutex> {
 public:
  static constexpr size_t most_waiting = 4096;

  /// `descriptor` outlives the sink.
  explicit QueuedSink(int descriptor) : descriptor_(descriptor), thread_([this] { write_on(); }) {}
  /// Writes what waits.
  ~QueuedSink() override {
    ending_ = true;
    ++changes_;
    changes_.notify_one();
    thread_.join();
  }
  QueuedSink(const QueuedSink&) = delete;
  QueuedSink& operator=(const QueuedSink&) = delete;

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
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
  void flush_() override {}

 private:
  /// What cannot be written is lost: there is nowhere to report it.
  static void write_all(int descriptor, std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(descriptor, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) return;
      text.remove_prefix(static_cast<size_t>(written));
    }
  }

  void write_on() {
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
  [[nodiscard]] std::vector<std::string> take() {
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

  int descriptor_;
  std::vector<std::string> lines_;  // of mutex_, as left_out_ and the formatter
  size_t left_out_ = 0;
  std::atomic<unsigned> changes_ = 0;
  std::atomic<bool> ending_ = false;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace diastole
