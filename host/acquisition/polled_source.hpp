#pragma once
// Samples of an instrument that is asked for each (sample_source.hpp).

#include <algorithm>
#include <cmath>

#include "host/acquisition/sample_source.hpp"

namespace diastole {

class PolledSource final : public SampleSource {
 public:
  PolledSource(Clock& clock, daq::PolledInstrument& instrument)
      : clock_(clock), instrument_(instrument), volts_(instrument.channels()) {}

  [[nodiscard]] TimerFacts timer(double) const override { return {instrument_.timer_rate_Hz(), false}; }
  SampleGrid start(double rate_Hz) override {
    grid_ = {clock_.now_ns(), rate_Hz};
    next_instrument_clock_ns_ = grid_.first_due_ns;
    return grid_;
  }
  /// Asks the instrument if a sample is due, and twice a second for its own clock.
  std::vector<SourceItem> take() override {
    std::vector<SourceItem> out;
    const uint64_t now_ns = clock_.now_ns();
    if (now_ns < next_due_ns()) return out;
    const uint64_t latest = std::max(next_index_, grid_.due_by(now_ns) - 1);
    miss_until(latest, out);
    next_index_ = latest + 1;
    const bool received = take_sample(latest, out);
    if (received && now_ns >= next_instrument_clock_ns_) read_instrument_clock(out);
    return out;
  }
  [[nodiscard]] uint64_t next_due_ns() const override { return grid_.due_ns(next_index_); }
  [[nodiscard]] bool complete(uint64_t until_ns) const override { return next_due_ns() > until_ns; }
  std::vector<SourceItem> finish(uint64_t until_ns) override {
    std::vector<SourceItem> out;
    const uint64_t expected = std::max(next_index_, grid_.due_by(until_ns));
    miss_until(expected, out);
    next_index_ = expected;
    return out;
  }

 private:
  static constexpr uint64_t instrument_clock_interval_ns = 500'000'000;
  static constexpr const char* slow_instrument = "the instrument answered slowly";

  void miss_until(uint64_t index, std::vector<SourceItem>& out) {
    uint64_t blocked = next_index_;
    while (blocked < index && grid_.due_ns(blocked) <= last_request_.until_ns)
      ++blocked;
    if (blocked > next_index_)
      out.push_back(Missing{next_index_, blocked - next_index_, last_request_.reason});
    if (index > blocked) out.push_back(Missing{blocked, index - blocked, "the host was late"});
  }
  /// Whether it was received.
  bool take_sample(uint64_t index, std::vector<SourceItem>& out) {
    const uint64_t asked_ns = clock_.now_ns();
    const daq::Outcome outcome = instrument_.read(volts_);
    const uint64_t answered_ns = clock_.now_ns();
    const bool finite = std::all_of(volts_.begin(), volts_.end(), [](double v) { return std::isfinite(v); });
    if (!outcome.ok || !finite) {
      last_request_ = {answered_ns, outcome.ok ? "the instrument sent no finite number" : outcome.fault};
      out.push_back(Missing{index, 1, last_request_.reason});
      return false;
    }
    last_request_ = {answered_ns, slow_instrument};
    out.push_back(Received{index, {asked_ns + (answered_ns - asked_ns) / 2}, volts_});
    return true;
  }
  void read_instrument_clock(std::vector<SourceItem>& out) {
    const uint64_t asked_ns = clock_.now_ns();
    next_instrument_clock_ns_ = asked_ns + instrument_clock_interval_ns;
    const auto timer = instrument_.read_timer();
    const uint64_t answered_ns = clock_.now_ns();
    last_request_ = {answered_ns, slow_instrument};
    if (!timer) return;
    const uint64_t half_ns = (answered_ns - asked_ns) / 2;
    out.push_back(InstrumentTime{asked_ns + half_ns, half_ns, *timer});
  }

  Clock& clock_;
  daq::PolledInstrument& instrument_;
  SampleGrid grid_;
  uint64_t next_index_ = 0;
  std::vector<double> volts_;
  struct Request {
    uint64_t until_ns = 0;
    std::string reason;  ///< why what came due before until_ns could not be sampled
  };
  Request last_request_;  ///< to the instrument
  uint64_t next_instrument_clock_ns_ = 0;
};

}  // namespace diastole
