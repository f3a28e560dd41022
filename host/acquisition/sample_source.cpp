#include "host/acquisition/sample_source.hpp"

#include <cmath>

#include "host/acquisition/block_source.hpp"
#include "host/acquisition/polled_source.hpp"
#include "host/acquisition/threaded_source.hpp"

namespace diastole {
namespace {

std::unique_ptr<SampleSource> source_on(Clock& clock, daq::Instrument& instrument) {
  if (auto* blocks = dynamic_cast<daq::BlockInstrument*>(&instrument)) {
    return std::make_unique<BlockSource>(clock, *blocks);
  }
  return std::make_unique<PolledSource>(clock, dynamic_cast<daq::PolledInstrument&>(instrument));
}

}  // namespace

uint64_t SampleGrid::due_ns(uint64_t index) const {
  return first_due_ns + static_cast<uint64_t>(std::llround(static_cast<double>(index) * ns_per_s / rate_Hz));
}

uint64_t SampleGrid::due_by(uint64_t now_ns) const {
  if (now_ns < first_due_ns) return 0;
  auto count = static_cast<uint64_t>(static_cast<double>(now_ns - first_due_ns) * rate_Hz / ns_per_s);
  while (due_ns(count) <= now_ns)
    ++count;
  while (count > 0 && due_ns(count - 1) > now_ns)
    --count;
  return count;
}

std::unique_ptr<SampleSource> make_source(Clock& clock, daq::Instrument& instrument) {
  if (clock.stands_still()) return source_on(clock, instrument);
  auto own_clock = std::make_unique<RealClock>();
  auto source = source_on(*own_clock, instrument);
  return std::make_unique<ThreadedSource>(std::move(own_clock), std::move(source));
}

}  // namespace diastole
