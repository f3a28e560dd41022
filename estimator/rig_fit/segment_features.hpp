#pragma once
// What a session's segments show, in a few hundred numbers a channel: the level on which effects are weighed.
//
// Each window (a segment: cycles of one waveform, a hold, a rest) of each channel gets an orthonormal basis over its
// samples, and a feature is the product of the channel with one of its functions, in kPa (or mL) times root samples:
//
//   repeats   harmonics of the cycle, up to 12 Hz: what every cycle shows; in a window of one cycle cosines of its length
//   first     low harmonics in the first cycle alone: how the motion sets in
//   drift     what grows from cycle to cycle in proportion to their number
//   cycles    level and size of each cycle, of some together in a long window: steps, softening, events
//
// later ones freed of what earlier ones hold. The noise of a feature is that of its frequency (noise_model.hpp) and,
// where single cycles count, their variation.

#include <Eigen/Dense>
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/rig_fit/noise_model.hpp"

namespace diastole::rig {

enum class Signal : size_t { cavity, pump, volume };
inline constexpr size_t signal_count = 3;
constexpr std::string_view name_of(Signal signal) {
  constexpr std::array<std::string_view, signal_count> names{"cavity_kPa", "pump_kPa", "cavity_mL"};
  return names[static_cast<size_t>(signal)];
}

/// Beyond, no pressure of a stroke has anything but noise and ringing.
inline constexpr double highest_feature_Hz = 12.0;

enum class FeatureKind { repeats, first, drift, cycles };

struct Feature {
  FeatureKind kind = FeatureKind::repeats;
  double harmonic = 0.0;  ///< of the cycle, or of half the window's length in a window of one
  double rows = 0.0;      ///< samples in which it lives
  double noise_sd = 0.0;
};

/// One window of one channel.
struct FeatureBlock {
  /// A function over the window's rows, 0 outside of [first, first + values.size()).
  struct Function {
    Eigen::Index first = 0;
    Eigen::VectorXf values;  ///< to seven digits: a projection's time is that of reading them
  };

  size_t run = 0;
  size_t segment = 0;
  Signal signal = Signal::cavity;
  bool at_rest = false;
  double cycles = 1.0;
  double period_s = 0.0;
  double range = 0.0;  ///< highest less lowest that was measured, kPa or mL
  std::string
      key;  ///< of its waveform: "sinusoidal 20 mL from 0 mL in 2 s, cavity_kPa"; runs of one rig share it
  size_t first = 0;  ///< its features are [first, first + features.size()) of all
  std::vector<Feature> features;

  // Samples [first_row, first_row + rows); features are factor^-1 (basis' values).
  size_t first_row = 0;
  Eigen::Index rows = 0;
  std::vector<Function> basis;
  Eigen::MatrixXd factor;  ///< lower triangle
  // The first `cyclic` functions repeat themselves after `cycle_rows`: a series is added up over its cycles for them.
  size_t cyclic = 0;
  Eigen::Index cycle_rows = 0;
};

/// What the instruments show of one run.
struct RunPrediction {
  Prediction pressures;
  std::vector<std::vector<double>> volumes;  ///< as SessionRun::volumes
};

class SegmentFeatures {
 public:
  SegmentFeatures(const Session& session, const NoiseModel& noise, size_t threads);

  [[nodiscard]] const std::vector<FeatureBlock>& blocks() const { return blocks_; }
  [[nodiscard]] Eigen::Index count() const { return static_cast<Eigen::Index>(count_); }
  [[nodiscard]] const Eigen::VectorXd& measured() const { return measured_; }
  /// Sets the features of one run; a column for each of several models, whose projections are faster together.
  void project(size_t run, std::span<const RunPrediction> shown, Eigen::Ref<Eigen::MatrixXd> out) const;
  /// The same of series of one block's rows, a column each.
  [[nodiscard]] static Eigen::MatrixXd project(const FeatureBlock& block, const Eigen::MatrixXd& values);
  /// The series that has these features and nothing else.
  [[nodiscard]] static Eigen::VectorXd series(const FeatureBlock& block, const Eigen::VectorXd& features);

 private:
  std::vector<FeatureBlock> blocks_;
  size_t count_ = 0;
  Eigen::VectorXd measured_;
};

}  // namespace diastole::rig
