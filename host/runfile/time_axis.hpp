#pragma once
// Controller ticks, host times and sample numbers as seconds since the start of run.

#include <cstdint>
#include <optional>

#include "host/controller/clock_map.hpp"
#include "host/journal/parsed_journal.hpp"

namespace diastole {

/// The controller's clock, in ticks over its rate, against the host's; the instrument's timer, unwrapped, likewise.
std::vector<ClockPair> controller_pairs(const ParsedJournal& parsed);
std::vector<ClockPair> instrument_pairs(const ParsedJournal& parsed);

class TimeAxis {
 public:
  /// Precondition: the journal has a start tick.
  TimeAxis(const ParsedJournal& parsed, const ClockMap& controller);

  [[nodiscard]] double of_tick(uint64_t tick) const;
  [[nodiscard]] double of_host_ns(uint64_t host_ns) const;
  [[nodiscard]] double of_host_s(double host_s) const { return map_.to_other_s(host_s) - start_s(); }
  /// When sample k was taken: as the host noted; if the instrument's timer counts its samples, as that timer's line
  /// against the host's clock tells, which knows nothing of blocks and how late they came.
  [[nodiscard]] double of_sample(uint64_t index, uint64_t host_ns) const;
  [[nodiscard]] bool instrument_counts() const { return timer_.has_value(); }
  [[nodiscard]] double host_at_start_s() const { return map_.to_host_s(start_s()); }
  [[nodiscard]] const ClockMap& map() const { return map_; }

 private:
  [[nodiscard]] double start_s() const { return static_cast<double>(start_tick_) / tick_rate_Hz_; }

  double tick_rate_Hz_;
  double sample_rate_Hz_;
  uint64_t start_tick_;
  ClockMap map_;
  std::optional<ClockMap> timer_;  ///< of an instrument whose timer counts samples
};

}  // namespace diastole
