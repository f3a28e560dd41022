#pragma once
// A sink of the log that nobody waits for: a thread of its own writes, so that whoever logs (the rig's thread with its
// heart-beat) waits neither for a reader of the log nor for another thread that is just writing. What would wait behind
// `most_waiting` lines is left out, and the log says how many.

#include <spdlog/sinks/base_sink.h>

#include <atomic>
#include <cstddef>
#include <string>
#include <thread>
#include <vector>

#include "host/transport/real_time.hpp"

namespace diastole {

class QueuedSink final : public spdlog::sinks::base_sink<InheritingMutex> {
 public:
  static constexpr size_t most_waiting = 4096;

  /// `descriptor` outlives the sink.
  explicit QueuedSink(int descriptor);
  /// Writes what waits.
  ~QueuedSink() override;
  QueuedSink(const QueuedSink&) = delete;
  QueuedSink& operator=(const QueuedSink&) = delete;

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override;
  void flush_() override {}

 private:
  void write_on();
  [[nodiscard]] std::vector<std::string> take();

  int descriptor_;
  std::vector<std::string> lines_;  // of mutex_, as left_out_ and the formatter
  size_t left_out_ = 0;
  std::atomic<unsigned> changes_ = 0;
  std::atomic<bool> ending_ = false;
  std::thread thread_;  // last: it uses the members above
};

}  // namespace diastole
