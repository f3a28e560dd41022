#include "host/daemon/daemon_log.hpp"

#include <fmt/format.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>

#include "host/daemon/queued_sink.hpp"

namespace diastole {
namespace {

/// JOURNAL_STREAM holds device and inode of the stream, and a pipe put between has others.
bool journal_reads_standard_error() {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat facts {};
  return stream != nullptr && ::fstat(STDERR_FILENO, &facts) == 0 &&
         fmt::format("{}:{}", facts.st_dev, facts.st_ino) == stream;
}

class JournalPriority final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm&, spdlog::memory_buf_t& out) override {
    const char* priority = message.level >= spdlog::level::err    ? "<3>"
                           : message.level == spdlog::level::warn ? "<4>"
                           : message.level == spdlog::level::info ? "<6>"
                                                                  : "<7>";
    out.append(priority, priority + 3);
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<JournalPriority>();
  }
};

}  // namespace

void set_up_daemon_log() {
  const auto log = std::make_shared<spdlog::logger>("diastole", std::make_shared<QueuedSink>(STDERR_FILENO));
  if (journal_reads_standard_error()) {
    auto formatter = std::make_unique<spdlog::pattern_formatter>();
    formatter->add_flag<JournalPriority>('*').set_pattern("%*%v");
    log->set_formatter(std::move(formatter));
  }
  spdlog::set_default_logger(log);
}

}  // namespace diastole
