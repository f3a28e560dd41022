#include "host/runfile/filtered_channel.hpp"

#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/spacing.hpp"
#include "protocol/signal/low_pass.hpp"

namespace diastole {

void add_filtered_channel(runfile::PressureTrace& pressure) {
  const auto cavity = pressure.channels.find(runfile::cavity_channel);
  const double spacing_s = runfile::median_spacing_s(pressure.time_s);
  if (cavity == pressure.channels.end() || spacing_s <= 0) return;
  signal::LowPassDesign design{.rate_Hz = 1 / spacing_s, .passes = signal::Passes::forward_and_backward};
  if (design.rate_Hz < signal::least_rate_over_cutoff * design.cutoff_Hz) return;
  pressure.channels[runfile::cavity_filtered_channel] =
      signal::filter_zero_phase(cavity->second, runfile::holes_before(pressure.time_s, spacing_s), design);
  pressure.notes[runfile::cavity_filtered_channel] = {
      {"filter", std::string("Butterworth low-pass, forward and backward")},
      {"cutoff_Hz", design.cutoff_Hz},
      {"order", int64_t{design.order}},
      {"passes", int64_t{2}},
      {"rate_Hz", design.rate_Hz},
      {"delay_s", 0.0}};
}

}  // namespace diastole
