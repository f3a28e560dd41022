#include "host/acquisition/live_trace.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace diastole {
namespace {

constexpr double ns_per_s = 1e9;
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// a - b of two unsigned counts.
double difference(uint64_t a, uint64_t b) { return static_cast<double>(static_cast<int64_t>(a - b)); }

}  // namespace

void LiveTrace::begin(std::string run_id, double sample_rate_Hz, double tick_rate_Hz) {
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

void LiveTrace::sample(uint64_t host_ns, double kPa, double filtered_kPa) {
  const std::lock_guard lock(mutex_);
  in_gap_ = false;
  bucket_.push_back({host_ns, kPa, filtered_kPa});
  if (bucket_.size() >= bucket_size_) close_bucket();
}

void LiveTrace::gap() {
  const std::lock_guard lock(mutex_);
  close_bucket();
  if (rows_.empty() || in_gap_) return;
  in_gap_ = true;
  keep({rows_.back().host_ns + 1, nan, nan});
}

void LiveTrace::close_bucket() {
  if (bucket_.empty()) return;
  const auto less = [](const Sample& a, const Sample& b) { return a.kPa < b.kPa; };
  auto [first, second] = std::minmax_element(bucket_.begin(), bucket_.end(), less);
  if (second < first) std::swap(first, second);
  keep(*first);
  if (second != first) keep(*second);
  bucket_.clear();
}

void LiveTrace::keep(const Sample& sample) {
  rows_.push_back(sample);
  if (rows_.size() <= most_rows) return;
  rows_.pop_front();
  ++first_row_;
}

void LiveTrace::clock(const ClockReading& reading) {
  const std::lock_guard lock(mutex_);
  reading_ = reading;
}

void LiveTrace::run_started(uint64_t tick) {
  const std::lock_guard lock(mutex_);
  start_tick_ = tick;
}

void LiveTrace::trigger(uint64_t tick) {
  const std::lock_guard lock(mutex_);
  trigger_ticks_.push_back(tick);
  if (trigger_ticks_.size() <= most_triggers) return;
  trigger_ticks_.pop_front();
  ++first_trigger_;
}

double LiveTrace::seconds_of(const Sample& sample) const {
  return difference(sample.host_ns, reading_->host_ns) / ns_per_s +
         difference(reading_->tick, *start_tick_) / tick_rate_Hz_;
}

LiveTrace::Excerpt LiveTrace::since(const std::string& run_id, uint64_t row, uint64_t trigger) const {
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

}  // namespace diastole
