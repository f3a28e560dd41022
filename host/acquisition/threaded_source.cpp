#include "host/acquisition/threaded_source.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include "host/transport/real_time.hpp"

namespace diastole {
namespace {

constexpr uint64_t most_sleep_ns = 50'000'000;     // so that the thread ends soon when it shall
constexpr uint64_t look_interval_ns = 10'000'000;  // of those who take what is ready

void append(std::vector<SourceItem>& to, std::vector<SourceItem> from) {
  to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
}

}  // namespace

ThreadedSource::ThreadedSource(std::unique_ptr<Clock> clock, std::unique_ptr<SampleSource> source)
    : clock_(std::move(clock)), source_(std::move(source)) {}

SampleGrid ThreadedSource::start(double rate_Hz) {
  const SampleGrid grid = source_->start(rate_Hz);
  thread_ = std::jthread([this](const std::stop_token& stop) { work(stop); });
  return grid;
}

void ThreadedSource::work(const std::stop_token& stop) {
  ask_for_real_time(instrument_priority);
  while (!stop.stop_requested()) {
    append(taken_, source_->take());
    hand_over();
    clock_->sleep_until_ns(std::min(source_->next_due_ns(), clock_->now_ns() + most_sleep_ns), nullptr);
  }
}

/// Waits for nobody: who holds the mutex may itself wait for the processor.
void ThreadedSource::hand_over() {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;
  append(ready_, std::exchange(taken_, {}));
  if (source_->complete(asked_until_ns_)) completed_until_ns_ = asked_until_ns_;
}

std::vector<SourceItem> ThreadedSource::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(ready_, {});
}

uint64_t ThreadedSource::next_due_ns() const { return clock_->now_ns() + look_interval_ns; }

bool ThreadedSource::complete(uint64_t until_ns) const {
  const std::lock_guard lock(mutex_);
  asked_until_ns_ = until_ns;
  return ready_.empty() && completed_until_ns_ >= until_ns;
}

std::vector<SourceItem> ThreadedSource::finish(uint64_t until_ns) {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
  std::vector<SourceItem> items = take();
  append(items, std::exchange(taken_, {}));
  append(items, source_->finish(until_ns));
  return items;
}

}  // namespace diastole
