#pragma once
// A source on a thread of its own (sample_source.hpp), for real time.

#include <algorithm>
#include <iterator>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "host/acquisition/sample_source.hpp"
#include "host/transport/real_time.hpp"

namespace diastole {

class ThreadedSource final : public SampleSource {
 public:
  /// `clock` is used by that thread only, with `source`.
  ThreadedSource(std::unique_ptr<Clock> clock, std::unique_ptr<SampleSource> source)
      : clock_(std::move(clock)), source_(std::move(source)) {}

  [[nodiscard]] TimerFacts timer(double rate_Hz) const override { return source_->timer(rate_Hz); }
  SampleGrid start(double rate_Hz) override {
    const SampleGrid grid = source_->start(rate_Hz);
    thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
    return grid;
  }
  /// Never waits.
  std::vector<SourceItem> take() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(ready_, {});
  }
  [[nodiscard]] uint64_t next_due_ns() const override { return clock_->now_ns() + look_interval_ns; }
  [[nodiscard]] bool complete(uint64_t until_ns) const override {
    const std::lock_guard lock(mutex_);
    asked_until_ns_ = until_ns;
    return ready_.empty() && completed_until_ns_ >= until_ns;
  }
  /// Waits until the instrument has answered, or failed to, what it is being asked.
  std::vector<SourceItem> finish(uint64_t until_ns) override {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    std::vector<SourceItem> items = take();
    append(items, std::exchange(pending_, {}));
    append(items, source_->finish(until_ns));
    return items;
  }

 private:
  static constexpr uint64_t most_sleep_ns = 50'000'000;     // so that the thread ends soon when it shall
  static constexpr uint64_t look_interval_ns = 10'000'000;  // of those who take what is ready

  static void append(std::vector<SourceItem>& to, std::vector<SourceItem> from) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  }

  void work(const std::stop_token& stop) {
    ask_for_real_time(instrument_priority);
    while (!stop.stop_requested()) {
      append(pending_, source_->take());
      hand_over();
      clock_->sleep_until_ns(std::min(source_->next_due_ns(), clock_->now_ns() + most_sleep_ns), nullptr);
    }
  }
  /// Waits for nobody: who holds the mutex may itself wait for the processor.
  void hand_over() {
    const std::unique_lock lock(mutex_, std::try_to_lock);
    if (!lock) return;
    append(ready_, std::exchange(pending_, {}));
    if (source_->complete(asked_until_ns_)) completed_until_ns_ = asked_until_ns_;
  }

  std::unique_ptr<Clock> clock_;
  std::unique_ptr<SampleSource> source_;  // of the thread while it runs
  std::vector<SourceItem> pending_;       // likewise: not yet handed over
  mutable std::mutex mutex_;
  std::vector<SourceItem> ready_;
  mutable uint64_t asked_until_ns_ = 0;  ///< by complete(); the thread answers in completed_until_ns_
  uint64_t completed_until_ns_ = 0;
  std::jthread thread_;  // last: it uses the members above
};

}  // namespace diastole
