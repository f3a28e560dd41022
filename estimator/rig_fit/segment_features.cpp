#include "estimator/rig_fit/segment_features.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/parallel/avx2.hpp"
#include "estimator/parallel/parallel_for.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::rig {
namespace {

constexpr size_t most_harmonics = 30;
constexpr size_t first_harmonics = 8;
constexpr size_t most_cosines = 120;
constexpr double most_groups = 48.0;  ///< of cycles whose levels are distinguished
constexpr double least_s = 0.5;       ///< shorter windows show nothing
constexpr double forever = std::numeric_limits<double>::infinity();
constexpr double independent = 1e-4;  ///< of a function's square that earlier ones do not hold

const std::vector<double>* pressures(const Prediction& shown, Signal signal) {
  return signal == Signal::cavity ? &shown.cavity_kPa : &shown.pump_kPa;
}

double product(const FeatureBlock::Function& f, const FeatureBlock::Function& g) {
  const Eigen::Index from = std::max(f.first, g.first);
  const Eigen::Index to = std::min(f.first + f.values.size(), g.first + g.values.size());
  if (to <= from) return 0.0;
  return f.values.segment(from - f.first, to - from)
      .cast<double>()
      .dot(g.values.segment(from - g.first, to - from).cast<double>());
}

/// Sixteen rows at a time, summed apart, so that sums do not wait for each other.
DIASTOLE_ALSO_FOR_AVX2 double dot(const float* function, const double* series, size_t rows) {
  using Eight __attribute__((vector_size(8 * sizeof(double)))) = double;
  using EightFloats __attribute__((vector_size(8 * sizeof(float)))) = float;
  Eight sums[2] = {}, values;
  EightFloats of_function;
  size_t k = 0;
  for (; k + 16 <= rows; k += 16) {
    for (const size_t half : {size_t{0}, size_t{1}}) {
      __builtin_memcpy(&of_function, function + k + 8 * half, sizeof of_function);
      __builtin_memcpy(&values, series + k + 8 * half, sizeof values);
      sums[half] += __builtin_convertvector(of_function, Eight) * values;
    }
  }
  sums[0] += sums[1];
  double sum = 0.0;
  for (int i = 0; i < 8; ++i)
    sum += sums[0][i];
  for (; k < rows; ++k)
    sum += static_cast<double>(function[k]) * series[k];
  return sum;
}

/// Functions over a window's rows, one after the other.
class BasisMaker {
 public:
  BasisMaker(FeatureBlock& block, std::vector<double> turns, std::vector<bool> missing)
      : block_(block), turns_(std::move(turns)), missing_(std::move(missing)) {
    block_.rows = static_cast<Eigen::Index>(turns_.size());
  }

  /// Of the turns; 0 but for those in [from, to).
  template <class Function>
  void add(FeatureKind kind, double harmonic, double rows, const Function& function, double from = -forever,
           double to = forever) {
    const auto first = std::ranges::lower_bound(turns_, from) - turns_.begin();
    const auto last = std::ranges::lower_bound(turns_, to) - turns_.begin();
    Eigen::VectorXf values(last - first);
    for (Eigen::Index k = 0; k < values.size(); ++k) {
      const auto row = static_cast<size_t>(first + k);
      values[k] = missing_[row] ? 0.0F : static_cast<float>(function(turns_[row]));
    }
    block_.basis.push_back({first, std::move(values)});
    block_.features.push_back({kind, harmonic, rows, 0.0});
  }
  void finish();
  [[nodiscard]] double rows() const { return static_cast<double>(turns_.size()); }

 private:
  FeatureBlock& block_;
  std::vector<double> turns_;  ///< cycles since the window's start, at each row; they increase
  std::vector<bool> missing_;
};

void BasisMaker::finish() {
  // Cholesky's rows one by one, leaving out what depends on the ones before.
  std::vector<FeatureBlock::Function> kept;
  std::vector<Feature> features;
  const auto all = static_cast<Eigen::Index>(block_.basis.size());
  Eigen::MatrixXd factor = Eigen::MatrixXd::Zero(all, all);
  for (size_t j = 0; j < block_.basis.size(); ++j) {
    FeatureBlock::Function& next = block_.basis[j];
    const auto row = static_cast<Eigen::Index>(kept.size());
    Eigen::VectorXd part(row);
    for (Eigen::Index i = 0; i < row; ++i)
      part[i] = (product(next, kept[static_cast<size_t>(i)]) - factor.row(i).head(i).dot(part.head(i))) /
                factor(i, i);
    const double square = next.values.cast<double>().squaredNorm();
    const double left = square - part.squaredNorm();
    if (!(left > independent * square)) continue;
    factor.row(row).head(row) = part.transpose();
    factor(row, row) = std::sqrt(left);
    kept.push_back(std::move(next));
    features.push_back(block_.features[j]);
  }
  const auto count = static_cast<Eigen::Index>(kept.size());
  block_.features = std::move(features);
  block_.factor = factor.topLeftCorner(count, count);
  block_.basis = std::move(kept);
}

void add_harmonics(BasisMaker& basis, FeatureKind kind, size_t count, double rows, const auto& weight,
                   double to = forever) {
  for (size_t h = 0; h <= count; ++h) {
    const double rate = 2.0 * std::numbers::pi * static_cast<double>(h);
    const auto cosine = [&](double x) { return weight(x) * std::cos(rate * x); };
    const auto sine = [&](double x) { return weight(x) * std::sin(rate * x); };
    basis.add(kind, static_cast<double>(h), rows, cosine, -forever, to);
    if (h > 0) basis.add(kind, static_cast<double>(h), rows, sine, -forever, to);
  }
}

/// The functions of a window of `cycles` cycles.
void add_cycles(BasisMaker& basis, double cycles, double period_s) {
  const auto harmonics = std::min(most_harmonics, static_cast<size_t>(highest_feature_Hz * period_s));
  const double all = basis.rows();
  const auto alike = [](double) { return 1.0; };
  add_harmonics(basis, FeatureKind::repeats, harmonics, all, alike);
  add_harmonics(basis, FeatureKind::first, std::min(first_harmonics, harmonics), all / cycles, alike, 1.0);
  if (cycles < 3.0) return;
  add_harmonics(basis, FeatureKind::drift, 2, all, [&](double x) { return (x - 0.5 * cycles) / cycles; });
  const double together = std::ceil(cycles / most_groups);
  for (double c = together > 1.0 ? 0.0 : 1.0; c < cycles; c += together)
    for (const double rate : {0.0, 2.0 * std::numbers::pi})
      basis.add(
          FeatureKind::cycles, rate == 0.0 ? 0.0 : 1.0, all / cycles * std::min(together, cycles - c),
          [&](double x) { return std::cos(rate * x); }, c, c + together);
}

void add_cosines(BasisMaker& basis, double length_s) {
  const auto count = std::min(most_cosines, static_cast<size_t>(2.0 * highest_feature_Hz * length_s));
  for (size_t h = 0; h <= count; ++h)
    basis.add(FeatureKind::repeats, static_cast<double>(h), basis.rows(),
              [&](double x) { return std::cos(std::numbers::pi * static_cast<double>(h) * x); });
}

/// Where a cycle is a whole number of rows, of which none is missing.
void find_cyclic(FeatureBlock& block, double rows_a_cycle) {
  constexpr float same = 1e-6F;  // of one: floats of the same phase differ by a tenth of it
  const double rounded = std::round(rows_a_cycle);
  if (!(rounded >= 1.0 && 2.0 * rounded <= static_cast<double>(block.rows))) return;
  const auto cycle = static_cast<Eigen::Index>(rounded);
  size_t count = 0;
  while (count < block.basis.size() && block.features[count].kind == FeatureKind::repeats) {
    const Eigen::VectorXf& values = block.basis[count++].values;
    for (Eigen::Index from = cycle; from < values.size(); from += cycle) {
      const Eigen::Index rows = std::min(cycle, values.size() - from);
      if (!((values.segment(from, rows) - values.head(rows)).cwiseAbs().maxCoeff() < same)) return;
    }
  }
  block.cyclic = count;
  block.cycle_rows = cycle;
}

double range_of(const std::vector<double>& values, size_t first, size_t last) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (size_t k = first; k < last; ++k) {
    if (!std::isfinite(values[k])) continue;
    low = std::min(low, values[k]);
    high = std::max(high, values[k]);
  }
  return std::max(high - low, 0.0);
}

std::string key_of(const runfile::Segment& segment, Signal signal) {
  return fmt::format("{} {:g} mL from {:g} mL in {:g} s, {}", segment.waveform, segment.stroke_mL,
                     segment.offset_mL, segment.period_s, name_of(signal));
}

void set_basis(FeatureBlock& block, const SessionRun& run, const std::vector<double>& values, size_t last) {
  const runfile::Segment& segment = run.segments[block.segment];
  std::vector<double> turns;
  std::vector<bool> missing;
  for (size_t k = block.first_row; k < last; ++k) {
    turns.push_back((run.sample_s[k] - segment.start_s) / block.period_s);
    missing.push_back(!std::isfinite(values[k]));
  }
  const double rows_a_cycle = static_cast<double>(turns.size() - 1) / (turns.back() - turns.front());
  BasisMaker basis(block, std::move(turns), std::move(missing));
  if (block.cycles > 1.0) {
    add_cycles(basis, block.cycles, block.period_s);
  } else {
    add_cosines(basis, block.period_s);
  }
  basis.finish();
  if (block.cycles > 1.0) find_cyclic(block, rows_a_cycle);
}

/// Harmonics of a gated volume's frames.
void set_volume_basis(FeatureBlock& block, const GatedVolume& volume) {
  constexpr size_t harmonics = 6;
  std::vector<double> turns;
  for (const double phase : volume.measured.phase_s)
    turns.push_back(phase / block.period_s);
  const size_t count = turns.size();
  BasisMaker basis(block, std::move(turns), std::vector<bool>(count, false));
  add_harmonics(basis, FeatureKind::repeats, std::min(harmonics, (count - 1) / 2), basis.rows(),
                [](double) { return 1.0; });
  basis.finish();
}

void set_noise(FeatureBlock& block, const ChannelNoise& noise, double cycle_sd, double rate_Hz) {
  // A cycle that is larger by a part moves its level by half of that part of the range, and its cosine by as much.
  const double cycle_change = 0.5 * cycle_sd * block.range;
  for (Feature& feature : block.features) {
    const double frequency = feature.harmonic / block.period_s * (block.cycles > 1.0 ? 1.0 : 0.5);
    const double of_cycles = feature.kind == FeatureKind::repeats
                                 ? (block.cycles > 1.0 ? feature.rows / block.cycles : 0.0)
                                 : feature.rows;
    const double variation = feature.harmonic <= 1.0 ? cycle_change * std::sqrt(of_cycles) : 0.0;
    feature.noise_sd = std::hypot(spectral_sd(noise, frequency, rate_Hz), variation);
  }
}

/// What the levels and sizes of single cycles scatter by themselves, from successive ones: a few events do not count. Noise of
/// 1/f wanders over a segment by some twice the variance that successive cycles show.
void raise_noise_of_cycles(FeatureBlock& block, const Eigen::VectorXd& measured) {
  constexpr size_t enough = 6;
  for (const double harmonic : {0.0, 1.0}) {
    std::vector<double> changes;
    double before = 0.0;
    size_t count = 0;
    for (size_t i = 0; i < block.features.size(); ++i) {
      if (block.features[i].kind != FeatureKind::cycles || block.features[i].harmonic != harmonic) continue;
      const double now = measured[static_cast<Eigen::Index>(block.first + i)];
      if (count++ > 0) changes.push_back(std::abs(now - before));
      before = now;
    }
    if (changes.size() < enough) continue;
    const double scatter = signal::deviation_of_normal(std::move(changes));
    for (Feature& feature : block.features)
      if (feature.kind != FeatureKind::repeats && feature.harmonic <= harmonic)
        feature.noise_sd = std::max(feature.noise_sd, scatter);
  }
}

/// A block for each segment and pressure of a run, without features as yet; none of what is too short.
void add_pressure_blocks(size_t r, const SessionRun& run, std::vector<FeatureBlock>& blocks) {
  for (size_t s = 0; s < run.segments.size(); ++s) {
    const runfile::Segment& segment = run.segments[s];
    FeatureBlock block{.run = r,
                       .segment = s,
                       .at_rest = segment.waveform == "hold",
                       .cycles = static_cast<double>(std::max<int64_t>(segment.cycles, 1)),
                       .period_s = segment.period_s,
                       .key = {},
                       .features = {},
                       .first_row = run.row_at(segment.start_s),
                       .rows = 0,
                       .basis = {},
                       .factor = {}};
    if (run.row_at(segment.end_s()) <= block.first_row || block.period_s * block.cycles < least_s) continue;
    for (const Signal signal : {Signal::cavity, Signal::pump}) {
      if (!run.pressure_kPa.contains(static_cast<Channel>(signal))) continue;
      block.signal = signal;
      block.key = key_of(segment, signal);
      blocks.push_back(block);
    }
  }
}

/// A block for each gated volume of a run, of the segment in which it begins.
void add_volume_blocks(size_t r, const SessionRun& run, std::vector<FeatureBlock>& blocks) {
  for (size_t v = 0; v < run.volumes.size(); ++v) {
    const GatedVolume& volume = run.volumes[v];
    if (volume.measured.phase_s.size() < 8) continue;
    size_t s = 0;
    while (s + 1 < run.segments.size() && volume.trigger_s.front() >= run.segments[s].end_s() - 1e-6)
      ++s;
    blocks.push_back({.run = r,
                      .segment = s,
                      .signal = Signal::volume,
                      .period_s = run.segments[s].period_s,
                      .key = key_of(run.segments[s], Signal::volume),
                      .features = {},
                      .first_row = v,
                      .rows = 0,
                      .basis = {},
                      .factor = {}});
  }
}

/// The block's range, features and their noise.
void describe_volume(FeatureBlock& block, const SessionRun& run) {
  const GatedVolume& volume = run.volumes[block.first_row];
  block.range = range_of(volume.measured.cavity_mL, 0, volume.measured.cavity_mL.size());
  set_volume_basis(block, volume);
  for (Feature& feature : block.features)
    feature.noise_sd = volume.measured.sigma_mL.front();
}

void describe_pressure(FeatureBlock& block, const SessionRun& run, const NoiseModel& noise) {
  const auto channel = static_cast<Channel>(block.signal);
  const std::vector<double>& values = run.pressure_kPa.at(channel);
  const size_t last = run.row_at(run.segments[block.segment].end_s());
  block.range = range_of(values, block.first_row, last);
  set_basis(block, run, values, last);
  const double rate_Hz =
      static_cast<double>(run.sample_s.size() - 1) / (run.sample_s.back() - run.sample_s.front());
  set_noise(block, noise.channels.at(channel), noise.cycle_sd, rate_Hz);
}

/// What was measured in a run, in a prediction's place.
RunPrediction as_recorded(const SessionRun& run) {
  RunPrediction recorded;
  for (const auto& [channel, values] : run.pressure_kPa)
    (channel == Channel::cavity ? recorded.pressures.cavity_kPa : recorded.pressures.pump_kPa) = values;
  for (const GatedVolume& volume : run.volumes)
    recorded.volumes.push_back(volume.measured.cavity_mL);
  return recorded;
}

}  // namespace

SegmentFeatures::SegmentFeatures(const Session& session, const NoiseModel& noise, size_t threads) {
  for (size_t r = 0; r < session.runs.size(); ++r) {
    add_pressure_blocks(r, session.runs[r], blocks_);
    add_volume_blocks(r, session.runs[r], blocks_);
  }
  parallel_for(blocks_.size(), threads, [&](size_t b) {
    FeatureBlock& block = blocks_[b];
    const SessionRun& run = session.runs[block.run];
    block.signal == Signal::volume ? describe_volume(block, run) : describe_pressure(block, run, noise);
  });
  for (FeatureBlock& block : blocks_) {
    block.first = count_;
    count_ += block.features.size();
  }
  measured_.resize(count());
  for (size_t r = 0; r < session.runs.size(); ++r)
    project(r, std::array{as_recorded(session.runs[r])}, measured_);
  for (FeatureBlock& block : blocks_)
    raise_noise_of_cycles(block, measured_);
}

Eigen::MatrixXd SegmentFeatures::project(const FeatureBlock& block, const Eigen::MatrixXd& values) {
  Eigen::MatrixXd products(static_cast<Eigen::Index>(block.basis.size()), values.cols());
  Eigen::MatrixXd cycle = Eigen::MatrixXd::Zero(block.cycle_rows, values.cols());
  for (Eigen::Index from = 0; block.cycle_rows > 0 && from < values.rows(); from += block.cycle_rows) {
    const Eigen::Index rows = std::min(block.cycle_rows, values.rows() - from);
    cycle.topRows(rows) += values.middleRows(from, rows);
  }
  for (size_t j = 0; j < block.basis.size(); ++j) {
    const FeatureBlock::Function& function = block.basis[j];
    const bool is_cyclic = j < block.cyclic;
    const Eigen::MatrixXd& series = is_cyclic ? cycle : values;
    const Eigen::Index rows = is_cyclic ? block.cycle_rows : function.values.size();
    // One by one: what is projected beside a series must not change its last digit.
    for (Eigen::Index m = 0; m < values.cols(); ++m)
      products(static_cast<Eigen::Index>(j), m) =
          dot(function.values.data(), series.col(m).data() + function.first, static_cast<size_t>(rows));
  }
  for (auto column : products.colwise())
    block.factor.triangularView<Eigen::Lower>().solveInPlace(column);
  return products;
}

Eigen::VectorXd SegmentFeatures::series(const FeatureBlock& block, const Eigen::VectorXd& features) {
  const Eigen::VectorXd sizes = block.factor.transpose().triangularView<Eigen::Upper>().solve(features);
  Eigen::VectorXd values = Eigen::VectorXd::Zero(block.rows);
  for (size_t j = 0; j < block.basis.size(); ++j)
    values.segment(block.basis[j].first, block.basis[j].values.size()) +=
        sizes[static_cast<Eigen::Index>(j)] * block.basis[j].values.cast<double>();
  return values;
}

void SegmentFeatures::project(size_t run, std::span<const RunPrediction> shown,
                              Eigen::Ref<Eigen::MatrixXd> out) const {
  for (const FeatureBlock& block : blocks_) {
    if (block.run != run) continue;
    Eigen::MatrixXd values(block.rows, out.cols());
    for (size_t m = 0; m < shown.size(); ++m) {
      const std::vector<double>& all = block.signal == Signal::volume
                                           ? shown[m].volumes[block.first_row]
                                           : *pressures(shown[m].pressures, block.signal);
      const size_t from = block.signal == Signal::volume ? 0 : block.first_row;
      for (Eigen::Index k = 0; k < values.rows(); ++k) {
        const double value = all[from + static_cast<size_t>(k)];
        values(k, static_cast<Eigen::Index>(m)) = std::isfinite(value) ? value : 0.0;
      }
    }
    out.middleRows(static_cast<Eigen::Index>(block.first), static_cast<Eigen::Index>(block.features.size())) =
        project(block, values);
  }
}

}  // namespace diastole::rig
