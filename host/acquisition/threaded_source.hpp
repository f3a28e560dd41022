#pragma once
// A source on a thread of its own (sample_source.hpp), for real time.

#include <mutex>
#include <stop_token>
#include <thread>

#include "host/acquisition/sample_source.hpp"

namespace diastole {

class ThreadedSource final : public SampleSource {
 public:
  /// `clock` is used by that thread only, with `source`.
  ThreadedSource(std::unique_ptr<Clock> clock, std::unique_ptr<SampleSource> source);

  [[nodiscard]] TimerFacts timer(double rate_Hz) const override { return source_->timer(rate_Hz); }
  SampleGrid start(double rate_Hz) override;
  /// Never waits.
  std::vector<SourceItem> take() override;
  [[nodiscard]] uint64_t next_due_ns() const override;
  [[nodiscard]] bool complete(uint64_t until_ns) const override;
  /// Waits until the instrument has answered, or failed to, what it is being asked.
  std::vector<SourceItem> finish(uint64_t until_ns) override;

 private:
  void work(const std::stop_token& stop);
  void hand_over();

  std::unique_ptr<Clock> clock_;
  std::unique_ptr<SampleSource> source_;  // of the thread while it runs
  std::vector<SourceItem> taken_;         // likewise: not yet handed over
  mutable std::mutex mutex_;
  std::vector<SourceItem> ready_;
  mutable uint64_t asked_until_ns_ = 0;  ///< by complete(); the thread answers in completed_until_ns_
  uint64_t completed_until_ns_ = 0;
  std::jthread thread_;  // last: it uses the members above
};

}  // namespace diastole
