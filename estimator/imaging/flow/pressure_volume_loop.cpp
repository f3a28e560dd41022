#include "estimator/imaging/flow/pressure_volume_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "estimator/io/number_table.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/commanded_volume.hpp"
#include "protocol/runfile/frame_bins.hpp"
#include "protocol/runfile/signal_delay.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

/// Of the cycle: chords of so many points leave out less than a half of a percent of a loop's area.
constexpr size_t most_windows = 64;
constexpr double samples_a_window = 2;
/// Scanner and pump count the same cycle with clocks of their own; the pump's may also be known to a millisecond only.
constexpr double same_period = 0.01;
/// Slower than this share of its peak, the flow is about to turn and dp/dV is 0/0.
constexpr double least_flow_share = 0.2;

int64_t cycles_in(double interval_s, double period_s, const runfile::RecordedRun& run,
                  const std::string& source) {
  const double cycles = interval_s / period_s;
  const double whole = std::max(1.0, std::round(cycles));
  if (std::abs(cycles / whole - 1) > same_period)
    throw InputError(
        {run.file, "",
         fmt::format("cycles of {:.4g} s do not fit the images' {:.4g} s ({})", period_s, interval_s, source),
         "Give the run of the phase-contrast scan, its segment with --segment, or --period."});
  return static_cast<int64_t>(whole);
}

/// Work = sum of p (Q - mean Q) over even times, exact for harmonics; its error from both curves'.
ValueWithError work_of(const PeriodicRegression& flow, const PeriodicRegression& pressure) {
  const auto times =
      static_cast<Eigen::Index>(2 * std::max(flow.coefficients.size(), pressure.coefficients.size()));
  Eigen::VectorXd by_flow = Eigen::VectorXd::Zero(flow.coefficients.size());
  Eigen::VectorXd by_pressure = Eigen::VectorXd::Zero(pressure.coefficients.size());
  const double step_s = flow.period_s / static_cast<double>(times);
  for (Eigen::Index i = 0; i < times; ++i) {
    const double t = step_s * static_cast<double>(i);
    Eigen::VectorXd flow_row = flow.value_row(t);
    flow_row[0] = 0;
    const Eigen::VectorXd pressure_row = pressure.value_row(t);
    by_flow += step_s * pressure.of(pressure_row) * flow_row;
    by_pressure += step_s * flow.of(flow_row) * pressure_row;
  }
  return {flow.of(by_flow), std::hypot(flow.sigma_of(by_flow), pressure.sigma_of(by_pressure))};
}

double correlation(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  const Eigen::VectorXd da = a.array() - a.mean(), db = b.array() - b.mean();
  const double size = da.norm() * db.norm();
  return size > 0 ? da.dot(db) / size : 0.0;
}

/// What the pump was commanded to at these times of a cycle, mL; empty without a pump's record of a whole one.
Eigen::VectorXd pumped_mL(const runfile::RunFile& file, size_t segment, const Eigen::VectorXd& time_s) {
  if (file.rows.pump.time_s.size() == 0) return {};
  const std::vector<runfile::Segment>& segments = file.run.segments;
  const double start_s = segments.at(segment).start_s;
  for (const double trigger_s : file.run.trigger_s) {
    if (trigger_s < start_s) continue;
    if (segment + 1 < segments.size() && trigger_s >= segments[segment + 1].start_s) break;
    runfile::CommandedVolume pump(file.rows.pump);
    const Eigen::VectorXd volume =
        time_s.unaryExpr([&](double after_s) { return pump.at(trigger_s + after_s); });
    if (volume.allFinite()) return volume;
  }
  return {};
}

/// Specimens fill with the pump, and their pressure rises with their volume. A slice whose normal points out of them shows the reverse.
void compare_with_pump(PressureVolumeLoop& loop, const runfile::RunFile& file,
                       const Eigen::VectorXd& time_s) {
  constexpr double opposed = -0.5;  // of a correlation: a quarter of a cycle late is none
  const auto count = static_cast<Eigen::Index>(loop.points.size());
  double sigma_mL = 0;
  Eigen::VectorXd volume(count), pressure(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    volume[i] = loop.points[static_cast<size_t>(i)].volume_mL.value;
    pressure[i] = loop.points[static_cast<size_t>(i)].pressure_kPa.value;
    sigma_mL = std::max(sigma_mL, loop.points[static_cast<size_t>(i)].volume_mL.sigma);
  }
  const double measured_mL = volume.maxCoeff() - volume.minCoeff();
  constexpr double clear_sigmas = 5.0;
  if (measured_mL < clear_sigmas * sigma_mL) return;  // noise correlates with anything
  const char* remedy =
      "If the slice's normal points out of the specimen, say --reverse; else this is another run's flow.";
  const Eigen::VectorXd pump = pumped_mL(file, loop.segment, time_s);
  if (pump.size() > 0) {
    if (const double with_pump = correlation(volume, pump); with_pump < opposed)
      throw InputError(
          {loop.source, fmt::format("segment {}", loop.segment),
           fmt::format("the measured volume falls while the pump fills (correlation {:.2f})", with_pump),
           remedy});
    const double stroke_mL = pump.maxCoeff() - pump.minCoeff();
    constexpr double more = 1.1;  // ringing lines overshoot by less
    if (stroke_mL > 0 && measured_mL > more * stroke_mL)
      loop.findings.push_back(
          {Severity::warning, "more-than-pumped",
           fmt::format("flow brings {:.1f} mL, and the pump gives {:.1f} mL", measured_mL, stroke_mL),
           loop.source, measured_mL / stroke_mL, "",
           "Check that this is the run of the scan, and its segment (--segment); and the venc."});
  } else if (const double with_pressure = correlation(volume, pressure); with_pressure < opposed) {
    loop.findings.push_back(
        {Severity::warning, "pressure-falls",
         fmt::format("the pressure falls while the volume rises (correlation {:.2f})", with_pressure),
         loop.source, with_pressure, "", remedy});
  }
}

}  // namespace

runfile::RecordedRun run_of_tables(const std::filesystem::path& pressure,
                                   const std::filesystem::path& trigger) {
  static constexpr std::array<std::string_view, 2> pressure_columns{"time_s", "cavity_kPa"};
  static constexpr std::array<std::string_view, 1> trigger_columns{"time_s"};
  const NumberTable samples = NumberTable::from_file(pressure, pressure_columns);
  const NumberTable edges = NumberTable::from_file(trigger, trigger_columns);
  runfile::RecordedRun run;
  run.file = pressure.string();
  for (size_t row = 0; row < samples.rows(); ++row) {
    run.pressure.time_s.push_back(samples.at(row, 0));
    run.pressure.channels["cavity_kPa"].push_back(samples.at(row, 1));
    if (row > 0 && !(samples.at(row, 0) > samples.at(row - 1, 0)))
      samples.fail(row, 0, "does not increase", "Sort the samples by time.");
  }
  for (size_t row = 0; row < edges.rows(); ++row) {
    run.trigger_s.push_back(edges.at(row, 0));
    if (row > 0 && !(edges.at(row, 0) > edges.at(row - 1, 0)))
      edges.fail(row, 0, "does not increase", "Sort the triggers by time.");
  }
  if (run.trigger_s.size() < 2 || run.pressure.time_s.size() < 2)
    throw InputError({edges.file(), "",
                      fmt::format("{} triggers and {} samples are no cycle", run.trigger_s.size(),
                                  run.pressure.time_s.size()),
                      "Give the pressure and the triggers of at least one whole cycle."});
  std::vector<double> periods;
  for (size_t i = 1; i < run.trigger_s.size(); ++i)
    periods.push_back(run.trigger_s[i] - run.trigger_s[i - 1]);
  runfile::Segment segment;
  segment.start_s = run.trigger_s.front();
  segment.waveform = "uploaded";
  segment.period_s = signal::median(std::move(periods));
  segment.cycles = static_cast<int64_t>(run.trigger_s.size());
  run.segments = {segment};
  return run;
}

PressureVolumeLoop pressure_volume_loop(const FlowMeasurement& flow, const runfile::RunFile& file,
                                        std::optional<size_t> segment) {
  const runfile::RecordedRun& run = file.run;
  runfile::FrameBinOptions how;
  how.segment = segment;
  PressureVolumeLoop loop;
  loop.source = run.file;
  loop.gate_every = how.gate_every =
      cycles_in(flow.interval_s(), runfile::binned_interval_s(run, how), run, flow.scan.interval_source);
  loop.delay_s = how.delay_s = runfile::signal_delay(run, how.channel).total_s();
  const double interval_s = runfile::binned_interval_s(run, how);
  const double samples = interval_s / file.rows.pressure.spacing().median_s;
  how.frames = std::clamp<size_t>(static_cast<size_t>(samples / samples_a_window), 8, most_windows);
  const runfile::FrameBins bins = runfile::bin_frames(run, file.rows, how);
  loop.segment = bins.segment;
  loop.cycles = bins.frames.front().cycles;

  const auto count = static_cast<Eigen::Index>(bins.frames.size());
  Eigen::VectorXd time(count), mean(count), variance(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const runfile::FrameBin& bin = bins.frames[static_cast<size_t>(i)];
    time[i] = 0.5 * (bin.window.from_s + bin.window.to_s) * flow.interval_s() / interval_s;
    mean[i] = bin.mean_kPa;
    variance[i] = runfile::variance_of_mean(bin, runfile::cavity_resolution_kPa(run));
  }
  // A few cycles' own spread may by chance be nothing.
  variance = variance.cwiseMax(0.1 * variance.mean() + 1e-12);
  const PeriodicRegression pressure =
      periodic_regression(time, mean, variance.asDiagonal(), flow.interval_s());
  double peak = 0;
  for (Eigen::Index i = 0; i < count; ++i)
    peak = std::max(peak, std::abs(flow.flow_at(time[i]).value));
  for (Eigen::Index i = 0; i < count; ++i) {
    LoopPoint point;
    point.phase_s = time[i];
    point.volume_mL = flow.volume_at(time[i]);
    point.pressure_kPa = {mean[i], std::sqrt(variance[i])};
    const ValueWithError rate = flow.flow_at(time[i]);
    if (std::abs(rate.value) > least_flow_share * peak) {
      const Eigen::VectorXd slope_row = pressure.slope_row(time[i]);
      const double stiffness = pressure.of(slope_row) / rate.value;
      point.stiffness_kPa_per_mL = {
          stiffness, std::hypot(pressure.sigma_of(slope_row), stiffness * rate.sigma) / std::abs(rate.value)};
    }
    loop.points.push_back(point);
  }
  loop.work_mJ = work_of(flow.flow, pressure);
  compare_with_pump(loop, file, time * (interval_s / flow.interval_s()));
  return loop;
}

}  // namespace diastole::imaging
