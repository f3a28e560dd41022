#include "estimator/rig_fit/cycle_scatter.hpp"

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <numbers>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole::rig {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr size_t fewest_pairs = 4;

/// The cycles of a segment but its first, in which the motion sets in.
std::vector<CycleRows> settled_cycles(const SessionRun& run, const runfile::Segment& segment) {
  std::vector<CycleRows> cycles;
  for (const CycleRows& rows : cycles_of(run))
    if (run.sample_s[rows.first] > segment.start_s + 0.5 * segment.period_s &&
        run.sample_s[rows.last - 1] < segment.end_s() + 1e-6)
      cycles.push_back(rows);
  return cycles;
}

/// The mean of squares of normal numbers, from their first quartile.
double mean_by_lower_quarter(std::vector<double> squares, double degrees) {
  const auto quarter = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 4);
  std::ranges::nth_element(squares, quarter);
  const double part = (static_cast<double>(squares.size() / 4) + 0.5) / static_cast<double>(squares.size());
  return *quarter * degrees / boost::math::quantile(boost::math::chi_squared(degrees), part);
}

/// Relative variance of that mean of so many: of a quantile p of n numbers, p (1 - p) / (n density^2). Successive differences
/// share a cycle: a correlation of -1/2, of squares 1/4, to either side.
double variance_by_lower_quarter(size_t count, double degrees) {
  const boost::math::chi_squared squares(degrees);
  const double quarter = boost::math::quantile(squares, 0.25);
  const double slope = boost::math::pdf(squares, quarter) * quarter;
  return (1.0 + 2.0 * 0.25) * 0.25 * 0.75 / (static_cast<double>(count) * slope * slope);
}

/// Values without the part that the columns make, by least squares.
VectorXd without(const VectorXd& values, const Eigen::MatrixXd& columns) {
  return values - columns * columns.colPivHouseholderQr().solve(values);
}

/// One pair's difference in the band.
struct BandChange {
  double square_kPa2 = 0.0;
  double noise_kPa2 = 0.0;
  VectorXd series;
};

BandChange in_band(const VectorXd& difference, const ChannelNoise& noise, double rate_Hz) {
  const Index rows = difference.size();
  const double length_s = static_cast<double>(rows) / rate_Hz;
  BandChange out{.series = VectorXd::Zero(rows)};
  const VectorXd turn = VectorXd::LinSpaced(rows, 0.0, 1.0 - 1.0 / static_cast<double>(rows));
  for (int harmonic = 1; harmonic <= highest_feature_Hz * length_s; ++harmonic) {
    const VectorXd angle = 2.0 * std::numbers::pi * harmonic * turn;
    const double norm = std::sqrt(2.0 / static_cast<double>(rows));
    for (const VectorXd& function :
         {VectorXd(norm * angle.array().cos()), VectorXd(norm * angle.array().sin())})
      out.series += function.dot(difference) * function;
    const double sd = spectral_sd(noise, harmonic / length_s, rate_Hz);
    out.noise_kPa2 += 2.0 * sd * sd;
  }
  out.square_kPa2 = 0.5 * out.series.squaredNorm() / static_cast<double>(rows);
  out.noise_kPa2 /= static_cast<double>(rows);
  return out;
}

CycleScatter scatter_of(const SessionProblem& problem, const std::vector<RunPrediction>& predicted_by_run,
                        Channel channel) {
  const bool cavity = channel == Channel::cavity;
  const ChannelNoise& noise = problem.noise().channels.at(channel);
  CycleScatter all;
  all.signal = cavity ? Signal::cavity : Signal::pump;
  double square = 0.0;
  double noise_square = 0.0;
  double weight = 0.0;
  double variance = 0.0;  // of `square`
  double rate_Hz = 0.0;
  for (size_t r = 0; r < problem.session().runs.size(); ++r) {
    const SessionRun& run = problem.session().runs[r];
    if (!run.pressure_kPa.contains(channel)) continue;
    const std::vector<double>& measured = run.pressure_kPa.at(channel);
    const Prediction& both = predicted_by_run[r].pressures;
    const std::vector<double>& shown = cavity ? both.cavity_kPa : both.pump_kPa;
    for (size_t s = 0; s < run.segments.size(); ++s) {
      const std::vector<CycleRows> cycles = settled_cycles(run, run.segments[s]);
      if (cycles.size() < 2) continue;
      SegmentScatter segment{.run = r, .segment = s};
      std::vector<double> squares;
      double degrees = 0.0;  // of freedom of a pair's square
      for (size_t c = 0; c + 1 < cycles.size(); ++c) {
        const auto rows = static_cast<Index>(
            std::min(cycles[c].last - cycles[c].first, cycles[c + 1].last - cycles[c + 1].first));
        const auto part = [&](const std::vector<double>& values, size_t cycle) {
          return Eigen::Map<const VectorXd>(values.data() + cycles[cycle].first, rows);
        };
        const VectorXd difference =
            (part(measured, c + 1) - part(shown, c + 1)) - (part(measured, c) - part(shown, c));
        if (rows < 8 || !difference.allFinite()) continue;
        Eigen::MatrixXd columns(rows, 4);
        columns.col(0).setOnes();
        columns.col(1).setLinSpaced(-1.0, 1.0);
        columns.col(2) = part(shown, c);
        columns.col(3).setZero();
        columns.col(3).segment(1, rows - 2) = columns.col(2).tail(rows - 2) - columns.col(2).head(rows - 2);
        rate_Hz = static_cast<double>(rows) / run.segments[s].period_s;
        const BandChange found = in_band(without(difference, columns), noise, rate_Hz);
        squares.push_back(found.square_kPa2);
        segment.noise_kPa2 = found.noise_kPa2;
        degrees = std::max(2.0, 2.0 * std::floor(highest_feature_Hz * run.segments[s].period_s) - 2.0);
        for (Index k = 0; k < rows; ++k)
          segment.phase[static_cast<size_t>(10 * k / rows)] += found.series[k] * found.series[k];
      }
      if (squares.empty()) continue;
      segment.pairs = squares.size();
      segment.square_kPa2 = mean_by_lower_quarter(squares, degrees) - segment.noise_kPa2;
      const auto pairs = static_cast<double>(segment.pairs);
      square += pairs * segment.square_kPa2;
      variance += pairs * pairs * segment.noise_kPa2 * segment.noise_kPa2 *
                  variance_by_lower_quarter(segment.pairs, degrees);
      noise_square += pairs * segment.noise_kPa2;
      weight += pairs;
      all.segments.push_back(segment);
    }
  }
  if (weight < fewest_pairs) return {};
  all.rms_kPa = std::sqrt(std::max(0.0, square / weight));
  all.noise_kPa = std::sqrt(noise_square / weight);
  // Of the noise's record the band holds two degrees of freedom a second and hertz.
  const double relative_variance =
      variance / (noise_square * noise_square) + rate_Hz / (noise.samples * highest_feature_Hz);
  constexpr double least_ratio = 1e-3;
  all.sds = std::log(std::max(1.0 + square / noise_square, least_ratio)) / std::sqrt(relative_variance);
  return all;
}

}  // namespace

std::vector<CycleScatter> cycle_scatter(const SessionProblem& problem, const SessionModel& model) {
  std::vector<RunPrediction> shown(problem.session().runs.size());
  parallel_for(shown.size(), problem.threads(), [&](size_t r) { shown[r] = problem.predict_run(r, model); });
  std::vector<CycleScatter> list;
  for (const auto& [channel, noise] : problem.noise().channels)
    if (CycleScatter found = scatter_of(problem, shown, channel); !found.segments.empty())
      list.push_back(std::move(found));
  return list;
}

}  // namespace diastole::rig
