#include "host/runfile/time_axis.hpp"

namespace diastole {
namespace {

constexpr double ns_per_s = 1e9;

}  // namespace

TimeAxis::TimeAxis(const JournalStory& story, const ClockMap& controller)
    : tick_rate_Hz_(story.begin.tick_rate_Hz),
      sample_rate_Hz_(story.begin.sample_rate_Hz),
      start_tick_(*story.start_tick),
      map_(controller) {
  if (story.begin.daq_timer_counts_samples) timer_ = fit_clock_map(story.daq_pairs);
}

double TimeAxis::of_tick(uint64_t tick) const {
  const double ticks = tick >= start_tick_ ? static_cast<double>(tick - start_tick_)
                                           : -static_cast<double>(start_tick_ - tick);
  return ticks / tick_rate_Hz_;
}

double TimeAxis::of_host_ns(uint64_t host_ns) const {
  return of_host_s(static_cast<double>(host_ns) / ns_per_s);
}

double TimeAxis::of_sample(uint64_t index, uint64_t host_ns) const {
  if (!timer_) return of_host_ns(host_ns);
  return of_host_s(timer_->to_host_s(static_cast<double>(index) / sample_rate_Hz_));
}

}  // namespace diastole
