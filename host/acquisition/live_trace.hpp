#pragma once
// The newest stretch of a run's pressure, for whoever looks on while it is acquired.
//
// The acquisition's thread writes, others read: a bounded ring, so that a reader can cost the acquisition nothing but
// the moment in which a row is copied. Faster streams are thinned to most_rows_a_second: of each bucket of
// samples, the least and the greatest are kept, in their order, so that no peak is lost from sight.
//
// Times are seconds since the run's start on the controller's clock to within the last clock reading's error (a fraction
// of a millisecond): for looking at. The run file's are fitted over the whole run.

#include <cstdint>
#include <deque>
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
  void begin(std::string run_id, double sample_rate_Hz, double tick_rate_Hz);

  void sample(uint64_t host_ns, double kPa, double filtered_kPa);
  /// Samples are missing from here on, until the next one.
  void gap();
  void clock(const ClockReading& reading);
  void run_started(uint64_t tick);
  void trigger(uint64_t tick);

  /// Rows and triggers from these numbers on, at most rows_at_once. Of another run than `run_id`: from its
  /// beginning. Nothing before the run's start on the host's clock is known.
  [[nodiscard]] Excerpt since(const std::string& run_id, uint64_t row, uint64_t trigger) const;

 private:
  struct Sample {
    uint64_t host_ns = 0;
    double kPa = 0;
    double filtered_kPa = 0;
  };
  void keep(const Sample& sample);
  void close_bucket();
  [[nodiscard]] double seconds_of(const Sample& sample) const;

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
