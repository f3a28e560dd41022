#pragma once
// Samples of an instrument that delivers numbered blocks (sample_source.hpp).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/acquisition/sample_source.hpp"

namespace diastole {

class BlockSource final : public SampleSource {
 public:
  BlockSource(Clock& clock, daq::BlockInstrument& instrument) : clock_(clock), instrument_(instrument) {}
  ~BlockSource() override {
    if (scanning_) instrument_.stop();
  }
  BlockSource(const BlockSource&) = delete;
  BlockSource& operator=(const BlockSource&) = delete;

  [[nodiscard]] TimerFacts timer(double rate_Hz) const override { return {rate_Hz, true}; }
  /// An instrument that does not start is tried again by take().
  SampleGrid start(double rate_Hz) override {
    grid_ = {clock_.now_ns(), rate_Hz};
    std::vector<SourceItem> none;
    start_scan(none);
    if (scanning_) grid_.first_due_ns = heard_ns_;
    scan_base_ = 0;
    return grid_;
  }
  /// One block, and five times a second at most its end on the instrument's clock (the number of its last sample + 1)
  /// with the host time of its arrival.
  std::vector<SourceItem> take() override {
    std::vector<SourceItem> out;
    if (clock_.now_ns() < next_look_ns_) return out;
    if (!scanning_) {
      start_scan(out);
      return out;
    }
    daq::Batch batch;
    const daq::Outcome outcome = instrument_.read(batch);
    const uint64_t now_ns = clock_.now_ns();
    if (!outcome.ok) {
      fail(outcome.fault, out);
      return out;
    }
    next_look_ns_ = now_ns + block_span_ns() / 4;
    if (!batch.volts.empty()) {
      heard_ns_ = now_ns;
      deliver(std::move(batch), out);
    } else if (now_ns - heard_ns_ > block_span_ns() + timeout_ns && fault_.empty()) {
      fault_ = fmt::format("no block came for {} ms", (now_ns - heard_ns_) / 1'000'000);
      out.push_back(InstrumentFault{fault_});
    }
    return out;
  }
  [[nodiscard]] uint64_t next_due_ns() const override { return next_look_ns_; }
  /// A block's span and a quarter of a second after `until_ns` nothing more is waited for.
  [[nodiscard]] bool complete(uint64_t until_ns) const override {
    return next_index_ >= grid_.due_by(until_ns) || clock_.now_ns() > until_ns + block_span_ns() + timeout_ns;
  }
  std::vector<SourceItem> finish(uint64_t until_ns) override {
    std::vector<SourceItem> out;
    if (scanning_) instrument_.stop();
    scanning_ = false;
    miss_until(grid_.due_by(until_ns), fault_.empty() ? "no block came any more" : fault_, out);
    return out;
  }

 private:
  static constexpr uint64_t timeout_ns = 250'000'000;           // for a block, beyond the time that it takes
  static constexpr uint64_t clock_interval_ns = 200'000'000;    // between looks at the instrument's clock
  static constexpr uint64_t restart_interval_ns = 500'000'000;  // between attempts to start the scan

  [[nodiscard]] uint64_t block_span_ns() const {
    return static_cast<uint64_t>(
        std::llround(static_cast<double>(instrument_.block_samples()) * ns_per_s / grid_.rate_Hz));
  }
  /// Sample 0 of a scan is taken when start() returns: its index is what is due then.
  void start_scan(std::vector<SourceItem>& out) {
    const daq::Outcome outcome = instrument_.start(grid_.rate_Hz);
    const uint64_t now_ns = clock_.now_ns();
    if (!outcome.ok) return fail(outcome.fault, out);
    scanning_ = true;
    heard_ns_ = now_ns;
    next_look_ns_ = now_ns + block_span_ns() / 2;
    const double since_s = static_cast<double>(now_ns - grid_.first_due_ns) / ns_per_s;
    scan_base_ = std::max(next_index_, static_cast<uint64_t>(std::llround(since_s * grid_.rate_Hz)));
  }
  void fail(std::string reason, std::vector<SourceItem>& out) {
    if (scanning_) instrument_.stop();
    scanning_ = false;
    next_look_ns_ = clock_.now_ns() + restart_interval_ns;
    if (fault_.empty()) out.push_back(InstrumentFault{reason});
    fault_ = std::move(reason);
  }
  void deliver(daq::Batch batch, std::vector<SourceItem>& out) {
    const size_t rows = batch.volts.size() / instrument_.channels();
    const uint64_t first = scan_base_ + batch.first_index;
    miss_until(first, fault_.empty() ? "blocks of the instrument were lost" : fault_, out);
    fault_.clear();
    Received received{first, {}, std::move(batch.volts)};
    for (size_t row = 0; row < rows; ++row)
      received.host_ns.push_back(grid_.due_ns(first + row));
    next_index_ = first + rows;
    out.push_back(std::move(received));
    if (heard_ns_ < next_clock_ns_) return;
    next_clock_ns_ = heard_ns_ + clock_interval_ns;
    out.push_back(InstrumentTime{heard_ns_, 0, static_cast<uint32_t>(next_index_)});
  }
  void miss_until(uint64_t index, const std::string& reason, std::vector<SourceItem>& out) {
    if (index > next_index_) out.push_back(Missing{next_index_, index - next_index_, reason});
    next_index_ = std::max(next_index_, index);
  }

  Clock& clock_;
  daq::BlockInstrument& instrument_;
  SampleGrid grid_;
  uint64_t next_index_ = 0;
  bool scanning_ = false;
  uint64_t scan_base_ = 0;  ///< index of the present scan's sample 0
  uint64_t next_look_ns_ = 0;
  uint64_t heard_ns_ = 0;  ///< of the instrument, last
  uint64_t next_clock_ns_ = 0;
  std::string fault_;  ///< since the last block; empty: none
};

}  // namespace diastole
