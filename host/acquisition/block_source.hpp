#pragma once
// Samples of an instrument that delivers numbered blocks (sample_source.hpp).

#include "host/acquisition/sample_source.hpp"

namespace diastole {

class BlockSource final : public SampleSource {
 public:
  BlockSource(Clock& clock, daq::BlockInstrument& instrument) : clock_(clock), instrument_(instrument) {}
  ~BlockSource() override;
  BlockSource(const BlockSource&) = delete;
  BlockSource& operator=(const BlockSource&) = delete;

  [[nodiscard]] TimerFacts timer(double rate_Hz) const override { return {rate_Hz, true}; }
  /// An instrument that does not start is tried again by take().
  SampleGrid start(double rate_Hz) override;
  /// One block, and five times a second at most its end on the instrument's clock (the number of its last sample + 1)
  /// with the host time of its arrival.
  std::vector<SourceItem> take() override;
  [[nodiscard]] uint64_t next_due_ns() const override { return next_look_ns_; }
  /// A block's span and a quarter of a second after `until_ns` nothing more is waited for.
  [[nodiscard]] bool complete(uint64_t until_ns) const override;
  std::vector<SourceItem> finish(uint64_t until_ns) override;

 private:
  [[nodiscard]] uint64_t block_span_ns() const;
  void start_scan(std::vector<SourceItem>& out);
  void fail(std::string reason, std::vector<SourceItem>& out);
  void deliver(daq::Batch batch, std::vector<SourceItem>& out);
  void miss_until(uint64_t index, const std::string& reason, std::vector<SourceItem>& out);

  Clock& clock_;
  daq::BlockInstrument& instrument_;
  SampleGrid grid_;
  uint64_t next_index_ = 0;
  bool scanning_ = false;
  uint64_t scan_base_ = 0;  ///< index of the present scan's sample 0
  uint64_t next_look_ns_ = 0;
  uint64_t heard_ns_ = 0;  ///< of the instrument, last
  uint64_t next_clock_ns_ = 0;
  std::string trouble_;  ///< since the last block; empty: none
};

}  // namespace diastole
