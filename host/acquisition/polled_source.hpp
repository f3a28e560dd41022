#pragma once
// Samples of an instrument that is asked for each (sample_source.hpp).

#include "host/acquisition/sample_source.hpp"

namespace diastole {

class PolledSource final : public SampleSource {
 public:
  PolledSource(Clock& clock, daq::PolledInstrument& instrument);

  [[nodiscard]] TimerFacts timer(double) const override { return {instrument_.timer_rate_Hz(), false}; }
  SampleGrid start(double rate_Hz) override;
  /// Asks the instrument if a sample is due, and twice a second for its own clock.
  std::vector<SourceItem> take() override;
  [[nodiscard]] uint64_t next_due_ns() const override { return grid_.due_ns(next_index_); }
  [[nodiscard]] bool complete(uint64_t until_ns) const override { return next_due_ns() > until_ns; }
  std::vector<SourceItem> finish(uint64_t until_ns) override;

 private:
  void miss_until(uint64_t index, std::vector<SourceItem>& out);
  /// Whether it was received.
  bool take_sample(uint64_t index, std::vector<SourceItem>& out);
  void read_instrument_clock(std::vector<SourceItem>& out);

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
