#pragma once
// Controller ticks, host times and sample numbers as seconds since the start of run.

#include <cstdint>
#include <optional>

#include "host/controller/clock_map.hpp"
#include "host/journal/parsed_journal.hpp"

namespace diastole {

class TimeAxis {
 public:
  /// Precondition: the journal has a start tick.
  TimeAxis(const ParsedJournal& parsed, const ClockMap& controller)
      : tick_rate_Hz_(parsed.begin.tick_rate_Hz),
        sample_rate_Hz_(parsed.begin.sample_rate_Hz),
        start_tick_(*parsed.start_tick),
        map_(controller) {
    if (parsed.begin.daq_timer_counts_samples) timer_ = fit_clock_map(instrument_pairs(parsed));
  }

  [[nodiscard]] double of_tick(uint64_t tick) const {
    const double ticks = tick >= start_tick_ ? static_cast<double>(tick - start_tick_)
                                             : -static_cast<double>(start_tick_ - tick);
    return ticks / tick_rate_Hz_;
  }
  [[nodiscard]] double of_host_ns(uint64_t host_ns) const {
    return of_host_s(static_cast<double>(host_ns) / ns_per_s);
  }
  [[nodiscard]] double of_host_s(double host_s) const { return map_.to_other_s(host_s) - start_s(); }
  /// When sample k was taken: as the host noted; if the instrument's timer counts its samples, as that timer's line
  /// against the host's clock gives, which knows nothing of blocks and how late they came.
  [[nodiscard]] double of_sample(uint64_t index, uint64_t host_ns) const {
    if (!timer_) return of_host_ns(host_ns);
    return of_host_s(timer_->to_host_s(static_cast<double>(index) / sample_rate_Hz_));
  }
  [[nodiscard]] bool instrument_counts() const { return timer_.has_value(); }
  [[nodiscard]] double host_at_start_s() const { return map_.to_host_s(start_s()); }
  [[nodiscard]] const ClockMap& map() const { return map_; }

  /// The controller's clock, in ticks over its rate, against the host's; the instrument's timer, unwrapped, likewise.
  static std::vector<ClockPair> controller_pairs(const ParsedJournal& parsed) {
    std::vector<ClockPair> pairs;
    for (const ClockRecord& clock : parsed.controller_clock)
      pairs.push_back(pair_of(clock, static_cast<double>(clock.tick) / parsed.begin.tick_rate_Hz));
    return pairs;
  }
  static std::vector<ClockPair> instrument_pairs(const ParsedJournal& parsed) {
    constexpr double timer_span = 4294967296.0;  // it wraps at 32 bits
    std::vector<ClockPair> pairs;
    double last_timer = 0, turns = 0;
    for (const InstrumentClockRecord& clock : parsed.instrument_clock) {
      const auto timer = static_cast<double>(clock.timer);
      if (timer < last_timer) ++turns;
      last_timer = timer;
      pairs.push_back(pair_of(clock, (timer + turns * timer_span) / parsed.begin.daq_timer_rate_Hz));
    }
    return pairs;
  }

 private:
  static constexpr double ns_per_s = 1e9;

  static ClockPair pair_of(const auto& clock, double other_s) {
    return {static_cast<double>(clock.host_ns) / ns_per_s, other_s,
            static_cast<double>(clock.half_round_trip_ns) / ns_per_s};
  }

  [[nodiscard]] double start_s() const { return static_cast<double>(start_tick_) / tick_rate_Hz_; }

  double tick_rate_Hz_;
  double sample_rate_Hz_;
  uint64_t start_tick_;
  ClockMap map_;
  std::optional<ClockMap> timer_;  ///< of an instrument whose timer counts samples
};

}  // namespace diastole
