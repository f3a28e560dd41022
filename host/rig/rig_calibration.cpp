// Zeroing and calibrating: orders of the rig like homing (rig_service.hpp).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host/calibration/at_rest.hpp"
#include "host/rig/rig_service.hpp"
#include "host/rig/utc.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr double rate_Hz = 300;  // of measurements at rest

bool asks_for(const CalibrationOrder& order, const std::string& channel) {
  return order.channels.empty() ||
         std::find(order.channels.begin(), order.channels.end(), channel) != order.channels.end();
}

}  // namespace

void RigService::calibrate(CalibrationOrder order, Done done) {
  queue_.give({order.kPa ? "calibrating" : "zeroing",
               [this, order = std::move(order)] { return do_calibrate(order); }, std::move(done)});
}

CalibrationReport RigService::do_calibrate(const CalibrationOrder& order) {
  CalibrationBook changed = book_;
  for (const std::string& channel : order.channels)
    (void)changed.of(channel);  // throws if there is no such
  const double true_rate_Hz = instrument_->plan_rate(rate_Hz).rate_Hz;
  const auto source = make_source(*clock_, *instrument_);
  const auto series = sample_at_rest(*clock_, *controller_, *source, instrument_->channels(), true_rate_Hz,
                                     order.seconds, [this] { return asked_to_stop(); });
  if (asked_to_stop()) throw HardwareError("rig", "the measurement was stopped", "Nothing was changed.");
  CalibrationReport report;
  for (size_t i = 0; i < series.size(); ++i) {
    const ChannelConfig& channel = rig_.daq.channels[i];
    if (!asks_for(order, channel.name)) continue;
    const auto expected = static_cast<size_t>(true_rate_Hz * order.seconds);
    const AtRest reading = series[i].size() < 3 ? AtRest{} : at_rest(series[i], true_rate_Hz);
    if (const std::string objection = objection_to(reading, channel.kPa_per_V, expected);
        !objection.empty()) {
      throw HardwareError(
          "channel " + channel.name, objection,
          "Nothing was changed. Let the rig come to rest, look at transducer, tap and cable, and try "
          "again.");
    }
    const CalibrationPoint point{reading.mean_V, order.kPa.value_or(0), utc_now(), order.operator_name};
    order.kPa ? changed.add_point(channel.name, point) : changed.set_zero(channel.name, point);
    report.channels.push_back({channel.name, reading.samples, reading.mean_V,
                               std::abs(channel.kPa_per_V) * reading.sd_V,
                               channel.kPa_per_V * reading.drift_V, changed.of(channel.name).points.size()});
  }
  changed.save();
  book_ = std::move(changed);
  rig_.daq.channels = book_.channels();
  for (ChannelReading& reading : report.channels) {
    const auto channel = std::ranges::find(rig_.daq.channels, reading.name, &ChannelConfig::name);
    reading.kPa_per_V = channel->kPa_per_V;
    reading.zero_V = channel->zero_V;
  }
  report.file = book_.file().string();
  return report;
}

}  // namespace diastole
