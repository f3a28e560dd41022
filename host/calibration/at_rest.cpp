#include "host/calibration/at_rest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace diastole {
namespace {

constexpr double independent_after_s = 0.05;

}  // namespace

AtRest at_rest(std::span<const double> volts, double rate_Hz) {
  const auto n = static_cast<double>(volts.size());
  const double middle = (n - 1) / 2;
  double sum = 0;
  double moment = 0;
  for (size_t i = 0; i < volts.size(); ++i) {
    sum += volts[i];
    moment += (static_cast<double>(i) - middle) * volts[i];
  }
  const double mean = sum / n;
  const double spread = n * (n * n - 1) / 12;  // sum of (i - middle)^2
  const double slope = moment / spread;
  double squares = 0;
  for (size_t i = 0; i < volts.size(); ++i) {
    const double rest = volts[i] - mean - slope * (static_cast<double>(i) - middle);
    squares += rest * rest;
  }
  const double sd = std::sqrt(squares / (n - 2));
  const double correlated = std::max(1.0, rate_Hz * independent_after_s);
  return {volts.size(), mean, sd, slope * (n - 1), sd * std::sqrt(correlated / spread) * (n - 1)};
}

std::string objection_to(const AtRest& reading, double kPa_per_V, size_t expected) {
  const double scale = std::abs(kPa_per_V);
  if (static_cast<double>(reading.samples) < least_received * static_cast<double>(expected)) {
    return fmt::format("only {} of {} samples came", reading.samples, expected);
  }
  if (scale * reading.sd_V > most_noise_kPa) {
    return fmt::format("the noise is {:.3f} kPa; more than {:g} kPa is no rest", scale * reading.sd_V,
                       most_noise_kPa);
  }
  const double drift_kPa = scale * std::abs(reading.drift_V);
  if (drift_kPa > most_drift_kPa && std::abs(reading.drift_V) > 4 * reading.drift_se_V) {
    return fmt::format("it drifted by {:.3f} kPa; more than {:g} kPa is no rest", drift_kPa, most_drift_kPa);
  }
  return {};
}

std::vector<std::vector<double>> sample_at_rest(Clock& clock, Controller& controller, SampleSource& source,
                                                size_t channels, double rate_Hz, double seconds,
                                                const std::function<bool()>& stop) {
  std::vector<std::vector<double>> series(channels);
  const auto take = [&](const std::vector<SourceItem>& items) {
    for (const SourceItem& item : items) {
      const auto* received = std::get_if<Received>(&item);
      if (received == nullptr) continue;
      for (size_t i = 0; i < received->volts.size(); ++i)
        series[i % channels].push_back(received->volts[i]);
    }
  };
  const SampleGrid grid = source.start(rate_Hz);
  const uint64_t end_ns = grid.first_due_ns + static_cast<uint64_t>(seconds * ns_per_s);
  while ((clock.now_ns() < end_ns || !source.complete(end_ns)) && !stop()) {
    controller.service();
    take(source.take());
    clock.sleep_until_ns(std::min(source.next_due_ns(), controller.next_due_ns()), controller.line());
  }
  take(source.finish(end_ns));
  return series;
}

}  // namespace diastole
