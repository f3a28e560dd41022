#pragma once
// A pressure transducer behind its fluid line: second-order response, a constant offset, noise correlated
// over some 10 ms (first-order autoregressive, seeded), and the converter's steps.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <deque>
#include <functional>
#include <numbers>
#include <random>

#include "tools/sim_rig/plant/flaws.hpp"
#include "tools/sim_rig/plant/second_order.hpp"

namespace diastole::sim_rig {

struct SensorConfig {
  double f0_Hz = 60;
  double zeta = 0.6;
  double offset_kPa = 0;
  double noise_kPa = 0;              ///< standard deviation
  double noise_correlation_ms = 10;  ///< > 0
  double range_kPa = 20;             ///< the converter spans -range to +range, and clips there
  int bits = 12;                     ///< 0: no steps
  SensorFlaws flaws{};
  std::function<double(double pressure_kPa, double time_s)> own_kPa = {};  ///< of a law of somebody's own
};

class Sensor {
 public:
  Sensor(const SensorConfig& config, double step_s, uint64_t seed)
      : config_(config),
        step_s_(step_s),
        line_(config.f0_Hz, config.zeta, step_s),
        noise_memory_(std::exp(-step_s / (config.noise_correlation_ms * 1e-3))),
        random_(seed) {
    noise_kPa_ = config_.noise_kPa * normal_(random_);
  }

  void advance(double mean_pressure_kPa) {
    line_.advance(mean_pressure_kPa);
    if (cycle_ > 0) since_first_cycle_s_ += step_s_;
    if (config_.flaws.delay_s > 0 || config_.flaws.lag_ppm > 0) {
      constexpr double longest_s = 1.0;
      history_.push_front(line_.value());
      if (static_cast<double>(history_.size()) * step_s_ > longest_s) history_.pop_back();
    }
    error_kPa_ += drift_kPa_per_s_ * step_s_;
    const double fresh = std::sqrt(1 - noise_memory_ * noise_memory_);
    noise_kPa_ = noise_memory_ * noise_kPa_ + fresh * config_.noise_kPa * normal_(random_);
  }
  void begin_cycle() { ++cycle_; }

  /// From now on the reading is off by `offset_kPa`, and by another `drift_kPa_per_s` every second; 0, 0: true again.
  void falsify(double offset_kPa, double drift_kPa_per_s) {
    error_kPa_ = offset_kPa;
    drift_kPa_per_s_ = drift_kPa_per_s;
  }

  /// The reading `since_step_s` after the last step, carried on along the response's own slope.
  [[nodiscard]] double reading_kPa(double since_step_s) const {
    const double late_s = config_.flaws.delay_s + 1e-6 * config_.flaws.lag_ppm * since_first_cycle_s_;
    double shown_kPa = line_kPa(late_s - since_step_s) * (1 + config_.flaws.gain);
    if (config_.own_kPa) shown_kPa = config_.own_kPa(shown_kPa, since_first_cycle_s_);
    const double analog = shown_kPa + config_.offset_kPa + noise_kPa_ + error_kPa_ + flaw_kPa();
    const double clipped = std::clamp(analog, -config_.range_kPa, config_.range_kPa);
    if (config_.bits == 0) return clipped;
    const double step_kPa = std::ldexp(config_.range_kPa, 1 - config_.bits);
    return std::round(clipped / step_kPa) * step_kPa;
  }

 private:
  /// What the line shows `earlier_s` before the last step.
  [[nodiscard]] double line_kPa(double earlier_s) const {
    if (earlier_s <= 0 || history_.size() < 2) return line_.value() - line_.rate() * earlier_s;
    const double place = std::min(earlier_s / step_s_, static_cast<double>(history_.size() - 1));
    const auto newer = std::min(static_cast<size_t>(place), history_.size() - 2);
    return std::lerp(history_[newer], history_[newer + 1], place - static_cast<double>(newer));
  }
  [[nodiscard]] double flaw_kPa() const {
    const SensorFlaws& flaws = config_.flaws;
    double error = flaws.drift_kPa_s * since_first_cycle_s_;
    if (flaws.step_in_cycle > 0 && cycle_ >= flaws.step_in_cycle) error += flaws.step_kPa;
    if (flaws.hum_kPa != 0) {
      constexpr double swell_Hz = 1.0 / 7.0;
      const double turn = 2 * std::numbers::pi * since_first_cycle_s_;
      error += flaws.hum_kPa * std::sin(turn * flaws.hum_Hz) * (1 + std::sin(turn * swell_Hz)) / 2;
    }
    return error;
  }

  SensorConfig config_;
  double step_s_;
  double error_kPa_ = 0;
  double drift_kPa_per_s_ = 0;
  SecondOrder line_;
  double noise_memory_;
  double noise_kPa_ = 0;
  int cycle_ = 0;
  double since_first_cycle_s_ = 0;
  std::deque<double> history_;  // of the line, the latest first; as long as readings are late
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace diastole::sim_rig
