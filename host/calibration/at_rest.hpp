#pragma once
// What the channels read while nothing moves: mean, scatter and drift over some seconds, and whether that is good
// enough to call it a value.

#include <functional>
#include <span>
#include <string>
#include <vector>

#include "host/acquisition/sample_source.hpp"
#include "host/config/rig_config.hpp"
#include "host/controller/controller.hpp"

namespace diastole {

struct AtRest {
  size_t samples = 0;
  double mean_V = 0;
  double sd_V = 0;        ///< about the straight line through the samples
  double drift_V = 0;     ///< of that line, from beginning to end
  double drift_se_V = 0;  ///< its standard error, samples taken as independent in blocks of 50 ms
};

inline constexpr double most_noise_kPa = 0.2;  ///< standard deviation; a good transducer shows 0.01 to 0.06
inline constexpr double most_drift_kPa = 0.1;  ///< over the measurement, beyond four standard errors
inline constexpr double least_received = 0.9;  ///< of the samples expected

/// One channel's samples, evenly spaced; precondition: three or more.
AtRest at_rest(std::span<const double> volts, double rate_Hz);

/// Empty, or in words why these samples are no value; `kPa_per_V` scales them.
std::string objection_to(const AtRest& reading, double kPa_per_V, size_t expected);

/// Samples for `seconds`, keeping the controller's heartbeats up. `stop` is asked meanwhile. One series a channel;
/// shorter than expected where samples were missing.
std::vector<std::vector<double>> sample_at_rest(Clock& clock, Controller& controller, SampleSource& source,
                                                size_t channels, double rate_Hz, double seconds,
                                                const std::function<bool()>& stop);

}  // namespace diastole
