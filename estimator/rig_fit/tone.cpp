#include "estimator/rig_fit/tone.hpp"

#include <fftw3.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <vector>

#include "estimator/inference/tail_probability.hpp"
#include "estimator/rig_fit/segment_features.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::rig {
namespace {

constexpr int64_t fewest_cycles = 4;
constexpr size_t neighbours = 20;      ///< bins to either side: their median is known to a fifth
constexpr size_t beside_harmonic = 2;  ///< bins that slow changes of the cycles fill
constexpr double most_p = 1e-3;
constexpr double stands_out = 3.0;  ///< over the noise's level: of noise one bin in twenty does

/// Of one window, bin by bin.
struct Window {
  size_t run, segment;
  double rows, rate_Hz;
  std::vector<double> square;  ///< of the amplitude, kPa^2
  std::vector<double> level;   ///< of noise there; 0: the bin does not count
  double noise_kPa2 = 0.0;     ///< its variance
  [[nodiscard]] size_t bin_of(double frequency_Hz) const {
    return static_cast<size_t>(std::lround(frequency_Hz * rows / rate_Hz));
  }
};

/// |amplitude|^2 of the bins from 0 to half the rate.
std::vector<double> squared_spectrum(std::vector<double> values) {
  static std::mutex planning;
  std::vector<double> transformed(2 * (values.size() / 2 + 1));  // pairs
  auto* pairs = reinterpret_cast<fftw_complex*>(transformed.data());
  fftw_plan plan = nullptr;
  {
    const std::scoped_lock lock(planning);
    plan = fftw_plan_dft_r2c_1d(static_cast<int>(values.size()), values.data(), pairs, FFTW_ESTIMATE);
  }
  fftw_execute(plan);
  {
    const std::scoped_lock lock(planning);
    fftw_destroy_plan(plan);
  }
  const double scale = 2.0 / static_cast<double>(values.size());
  std::vector<double> squares;
  for (size_t k = 0; 2 * k < transformed.size(); ++k)
    squares.push_back(
        scale * scale *
        (transformed[2 * k] * transformed[2 * k] + transformed[2 * k + 1] * transformed[2 * k + 1]));
  return squares;
}

/// What neither a periodic motion fills nor slow changes of it.
bool is_between_harmonics(size_t bin, size_t cycles, double frequency_Hz) {
  const size_t off = std::min(bin % cycles, cycles - bin % cycles);
  return frequency_Hz > highest_feature_Hz ? off > 0 : off > beside_harmonic;
}

void set_levels(Window& window, size_t cycles) {
  std::vector<size_t> counted;
  for (size_t k = 1; k + 1 < window.square.size(); ++k)
    if (is_between_harmonics(k, cycles, static_cast<double>(k) * window.rate_Hz / window.rows))
      counted.push_back(k);
  window.level.assign(window.square.size(), 0.0);
  double sum = 0.0, count = 0.0;
  for (size_t i = neighbours; i + neighbours < counted.size(); ++i) {
    std::vector<double> around;
    for (size_t j = i - neighbours; j <= i + neighbours; ++j)
      if (j != i) around.push_back(window.square[counted[j]]);
    window.level[counted[i]] =
        signal::median(std::move(around)) / std::numbers::ln2;  // of an exponential variable
    sum += window.level[counted[i]];
    count += 1.0;
  }
  // Half of a squared amplitude in each of as many bins as there are pairs of rows.
  window.noise_kPa2 = count > 0.0 ? 0.25 * window.rows * sum / count : 0.0;
}

std::optional<Window> window_of(const Session& session, size_t r, size_t s) {
  const SessionRun& run = session.runs[r];
  const runfile::Segment& segment = run.segments[s];
  if (segment.waveform == "hold" || segment.cycles < fewest_cycles) return {};
  const std::vector<double>& values = run.pressure_kPa.at(Channel::cavity);
  const double rate_Hz =
      static_cast<double>(run.sample_s.size() - 1) / (run.sample_s.back() - run.sample_s.front());
  const auto first = run.row_at(segment.start_s + segment.period_s);
  const auto cycles = static_cast<size_t>(segment.cycles - 1);
  const auto rows =
      static_cast<size_t>(std::lround(static_cast<double>(cycles) * segment.period_s * rate_Hz));
  if (first + rows > values.size() || rows < 8 * neighbours) return {};
  Eigen::VectorXd series =
      Eigen::Map<const Eigen::VectorXd>(values.data() + first, static_cast<Eigen::Index>(rows));
  if (!series.allFinite()) return {};
  const Eigen::VectorXd turn = Eigen::VectorXd::LinSpaced(series.size(), -1.0, 1.0);
  series.array() -= series.mean();
  series -= turn * (turn.dot(series) / turn.squaredNorm());
  Window window{.run = r,
                .segment = s,
                .rows = static_cast<double>(rows),
                .rate_Hz = rate_Hz,
                .square = {},
                .level = {}};
  window.square = squared_spectrum({series.data(), series.data() + series.size()});
  set_levels(window, cycles);
  return window;
}

}  // namespace

std::optional<Tone> find_tone(const Session& session) {
  std::vector<Window> windows;
  for (size_t r = 0; r < session.runs.size(); ++r)
    for (size_t s = 0; s < session.runs[r].segments.size(); ++s)
      if (auto window = window_of(session, r, s)) windows.push_back(std::move(*window));
  if (windows.empty()) return {};
  double resolution_Hz = windows.front().rate_Hz, highest_Hz = 0.0;
  for (const Window& window : windows) {
    resolution_Hz = std::min(resolution_Hz, window.rate_Hz / window.rows);
    highest_Hz = std::max(highest_Hz, 0.5 * window.rate_Hz);
  }
  Tone clearest{.resolution_Hz = resolution_Hz};
  const double frequencies = std::floor(highest_Hz / resolution_Hz);
  for (double k = 1.0; k < frequencies; k += 1.0) {
    const double frequency_Hz = k * resolution_Hz;
    double ratios = 0.0, count = 0.0, square = 0.0, noise = 0.0, rows = 0.0, largest = 0.0, clear = 0.0;
    Tone here{.frequency_Hz = frequency_Hz, .resolution_Hz = resolution_Hz};
    for (const Window& window : windows) {
      const size_t bin = window.bin_of(frequency_Hz);
      if (bin >= window.level.size() || window.level[bin] <= 0.0) continue;
      const double ratio = window.square[bin] / window.level[bin];
      ratios += ratio;
      count += 1.0;
      clear += ratio > stands_out ? 1.0 : 0.0;
      square += 0.5 * window.rows * (window.square[bin] - window.level[bin]);
      noise += window.rows * window.noise_kPa2;
      rows += window.rows;
      if (ratio <= largest) continue;
      largest = ratio;
      here.run = window.run;
      here.segment = window.segment;
    }
    if (2.0 * count < static_cast<double>(windows.size()) || 2.0 * clear < count) continue;
    here.p_value = std::min(1.0, frequencies * inference::chi_square_tail(2.0 * ratios, 2.0 * count));
    here.excess_chi2 = 2.0 * (ratios - count);
    here.rms_kPa = std::sqrt(std::max(0.0, square / rows));
    here.noise_kPa = std::sqrt(noise / rows);
    if (here.excess_chi2 > clearest.excess_chi2) clearest = here;
  }
  return clearest.p_value < most_p ? std::optional(clearest) : std::nullopt;
}

}  // namespace diastole::rig
