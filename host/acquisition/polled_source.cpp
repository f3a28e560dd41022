#include "host/acquisition/polled_source.hpp"

#include <algorithm>
#include <cmath>

namespace diastole {
namespace {

constexpr uint64_t instrument_clock_interval_ns = 500'000'000;
constexpr const char* slow_instrument = "the instrument answered slowly";

}  // namespace

PolledSource::PolledSource(Clock& clock, daq::PolledInstrument& instrument)
    : clock_(clock), instrument_(instrument), volts_(instrument.channels()) {}

SampleGrid PolledSource::start(double rate_Hz) {
  grid_ = {clock_.now_ns(), rate_Hz};
  next_instrument_clock_ns_ = grid_.first_due_ns;
  return grid_;
}

std::vector<SourceItem> PolledSource::take() {
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

std::vector<SourceItem> PolledSource::finish(uint64_t until_ns) {
  std::vector<SourceItem> out;
  const uint64_t expected = std::max(next_index_, grid_.due_by(until_ns));
  miss_until(expected, out);
  next_index_ = expected;
  return out;
}

void PolledSource::miss_until(uint64_t index, std::vector<SourceItem>& out) {
  uint64_t blocked = next_index_;
  while (blocked < index && grid_.due_ns(blocked) <= last_request_.until_ns)
    ++blocked;
  if (blocked > next_index_) out.push_back(Missing{next_index_, blocked - next_index_, last_request_.reason});
  if (index > blocked) out.push_back(Missing{blocked, index - blocked, "the host was late"});
}

bool PolledSource::take_sample(uint64_t index, std::vector<SourceItem>& out) {
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

void PolledSource::read_instrument_clock(std::vector<SourceItem>& out) {
  const uint64_t asked_ns = clock_.now_ns();
  next_instrument_clock_ns_ = asked_ns + instrument_clock_interval_ns;
  const auto timer = instrument_.read_timer();
  const uint64_t answered_ns = clock_.now_ns();
  last_request_ = {answered_ns, slow_instrument};
  if (!timer) return;
  const uint64_t half_ns = (answered_ns - asked_ns) / 2;
  out.push_back(InstrumentTime{asked_ns + half_ns, half_ns, *timer});
}

}  // namespace diastole
