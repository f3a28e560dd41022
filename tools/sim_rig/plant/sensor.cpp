#include "tools/sim_rig/plant/sensor.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::sim_rig {

Sensor::Sensor(const SensorConfig& config, double step_s, uint64_t seed)
    : config_(config),
      step_s_(step_s),
      line_(config.f0_Hz, config.zeta, step_s),
      noise_memory_(std::exp(-step_s / (config.noise_correlation_ms * 1e-3))),
      random_(seed) {
  noise_kPa_ = config_.noise_kPa * normal_(random_);
}

void Sensor::advance(double mean_pressure_kPa) {
  line_.advance(mean_pressure_kPa);
  error_kPa_ += drift_kPa_per_s_ * step_s_;
  const double fresh = std::sqrt(1 - noise_memory_ * noise_memory_);
  noise_kPa_ = noise_memory_ * noise_kPa_ + fresh * config_.noise_kPa * normal_(random_);
}

void Sensor::falsify(double offset_kPa, double drift_kPa_per_s) {
  error_kPa_ = offset_kPa;
  drift_kPa_per_s_ = drift_kPa_per_s;
}

double Sensor::reading_kPa(double since_step_s) const {
  const double analog =
      line_.value() + line_.rate() * since_step_s + config_.offset_kPa + noise_kPa_ + error_kPa_;
  const double clipped = std::clamp(analog, -config_.range_kPa, config_.range_kPa);
  if (config_.bits == 0) return clipped;
  const double step_kPa = std::ldexp(config_.range_kPa, 1 - config_.bits);
  return std::round(clipped / step_kPa) * step_kPa;
}

}  // namespace diastole::sim_rig
