#pragma once
// A pressure transducer behind its fluid line: second-order response, a constant offset, noise correlated
// over some 10 ms (first-order autoregressive, seeded), and the converter's steps.

#include <cstdint>
#include <deque>
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
};

class Sensor {
 public:
  Sensor(const SensorConfig& config, double step_s, uint64_t seed);

  void advance(double mean_pressure_kPa);
  void begin_cycle();

  /// From now on the reading is off by `offset_kPa`, and by another `drift_kPa_per_s` every second; 0, 0: true again.
  void falsify(double offset_kPa, double drift_kPa_per_s);

  /// The reading `since_step_s` after the last step, carried on along the response's own slope.
  [[nodiscard]] double reading_kPa(double since_step_s) const;

 private:
  /// What the line shows `earlier_s` before the last step.
  [[nodiscard]] double line_kPa(double earlier_s) const;
  [[nodiscard]] double flaw_kPa() const;

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
