#pragma once
// The newest stretch of a run's pressure, for whoever looks on while it is acquired.
//
// The acquisition's thread writes, others read: a bounded ring, so that a reader can cost the acquisition nothing but
// the moment in which a row is copied. Faster streams are thinned to most_rows_a_second: of each bucket of
// samples, the least and the greatest are kept, in their order, so that no peak is lost from sight.
//
// Times are seconds since the run's start on the controller's clock to within the last clock reading's error (a fraction
// of a millisecond): for looking at. The run file's are fitted over the whole run.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "host/controller/controller.hpp"
#include "host/transport/real_time.hpp"

namespace diastole {

class LiveTrace {
 public:
  static constexpr double most_rows_a_second = 300;
  static constexpr size_t most_rows = 18'000;     ///< kept: a minute at least
  static constexpr size_t most_triggers = 1'000;  ///< kept
  static constexpr size_t rows_at_once = 1'000;

  struct Row {
    double time_s = 0;
    double kPa = 0;           ///< NaN: the sample is missing
    double filtered_kPa = 0;  ///< NaN: the sample is missing, or the rate is too low to filter
  };
  /// What came after a given row and trigger; both are numbered from 0 over the whole run.
  struct Excerpt {
    std::string run_id;
    uint64_t first_row = 0;  ///< of `rows`; later than asked for when those were dropped
    std::vector<Row> rows;
    uint64_t first_trigger = 0;
    std::vector<double> trigger_s;
  };

  /// Forgets the last run.
  void begin(std::string run_id, double sample_rate_Hz, double tick_rate_Hz) {
    const std::lock_guard lock(mutex_);
    run_id_ = std::move(run_id);
    tick_rate_Hz_ = tick_rate_Hz;
    // A bucket leaves two rows; a stream that is slow enough is kept as it is.
    const double thinning = sample_rate_Hz / most_rows_a_second;
    bucket_size_ = thinning <= 1.01 ? 1 : static_cast<size_t>(std::ceil(2 * thinning));
    bucket_.clear();
    rows_.clear();
    trigger_ticks_.clear();
    first_row_ = first_trigger_ = 0;
    reading_.reset();
    start_tick_.reset();
    in_gap_ = false;
  }

  void sample(uint64_t host_ns, double kPa, double filtered_kPa) {
    const std::lock_guard lock(mutex_);
    in_gap_ = false;
    bucket_.push_back({host_ns, kPa, filtered_kPa});
    if (bucket_.size() >= bucket_size_) close_bucket();
  }
  /// Samples are missing from here on, until the next one.
  void gap() {
    const std::lock_guard lock(mutex_);
    close_bucket();
    if (rows_.empty() || in_gap_) return;
    in_gap_ = true;
    keep({rows_.back().host_ns + 1, nan, nan});
  }
  void clock(const ClockReading& reading) {
    const std::lock_guard lock(mutex_);
    reading_ = reading;
  }
  void run_started(uint64_t tick) {
    const std::lock_guard lock(mutex_);
    start_tick_ = tick;
  }
  void trigger(uint64_t tick) {
    const std::lock_guard lock(mutex_);
    trigger_ticks_.push_back(tick);
    if (trigger_ticks_.size() <= most_triggers) return;
    trigger_ticks_.pop_front();
    ++first_trigger_;
  }

  /// Rows and triggers from these numbers on, at most rows_at_once. Of another run than `run_id`: from its
  /// beginning. Nothing before the run's start on the host's clock is known.
  [[nodiscard]] Excerpt since(const std::string& run_id, uint64_t row, uint64_t trigger) const {
    const std::lock_guard lock(mutex_);
    Excerpt excerpt{.run_id = run_id_, .rows = {}, .trigger_s = {}};
    if (run_id != run_id_) row = trigger = 0;
    row = std::clamp(row, first_row_, first_row_ + rows_.size());
    trigger = std::clamp(trigger, first_trigger_, first_trigger_ + trigger_ticks_.size());
    excerpt.first_row = row;
    excerpt.first_trigger = trigger;
    if (!reading_ || !start_tick_) return excerpt;
    const size_t begin = row - first_row_;
    const size_t end = std::min(rows_.size(), begin + rows_at_once);
    for (size_t i = begin; i < end; ++i)
      excerpt.rows.push_back({seconds_of(rows_[i]), rows_[i].kPa, rows_[i].filtered_kPa});
    for (size_t i = trigger - first_trigger_; i < trigger_ticks_.size(); ++i)
      excerpt.trigger_s.push_back(difference(trigger_ticks_[i], *start_tick_) / tick_rate_Hz_);
    return excerpt;
  }

 private:
  static constexpr double ns_per_s = 1e9;
  static constexpr double nan = std::numeric_limits<double>::quiet_NaN();

  /// a - b of two unsigned counts.
  static double difference(uint64_t a, uint64_t b) {
    return static_cast<double>(static_cast<int64_t>(a - b));
  }

  struct Sample {
    uint64_t host_ns = 0;
    double kPa = 0;
    double filtered_kPa = 0;
  };
  void keep(const Sample& sample) {
    rows_.push_back(sample);
    if (rows_.size() <= most_rows) return;
    rows_.pop_front();
    ++first_row_;
  }
  void close_bucket() {
    if (bucket_.empty()) return;
    const auto less = [](const Sample& a, const Sample& b) { return a.kPa < b.kPa; };
    auto [first, second] = std::minmax_element(bucket_.begin(), bucket_.end(), less);
    if (second < first) std::swap(first, second);
    keep(*first);
    if (second != first) keep(*second);
    bucket_.clear();
  }
  [[nodiscard]] double seconds_of(const Sample& sample) const {
    return difference(sample.host_ns, reading_->host_ns) / ns_per_s +
           difference(reading_->tick, *start_tick_) / tick_rate_Hz_;
  }

  mutable InheritingMutex mutex_;  // the server's thread, which has no priority, holds it too
  std::string run_id_;
  double tick_rate_Hz_ = 1;
  size_t bucket_size_ = 1;
  std::vector<Sample> bucket_;
  std::deque<Sample> rows_;
  uint64_t first_row_ = 0;
  std::deque<uint64_t> trigger_ticks_;
  uint64_t first_trigger_ = 0;
  std::optional<ClockReading> reading_;
  std::optional<uint64_t> start_tick_;
  bool in_gap_ = false;
};

}  // namespace diastole
