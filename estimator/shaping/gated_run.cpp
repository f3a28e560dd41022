#include "estimator/shaping/gated_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <sstream>

#include "estimator/inference/covariance.hpp"
#include "estimator/rig/sampled_signal.hpp"
#include "estimator/shaping/specimen_volume.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole::shaping {
namespace {

using Complex = std::complex<double>;
using runfile::RecordedRun;
using std::numbers::pi;

constexpr std::string_view lead_mark = "# the wanted curve begins after, s: ";

/// Of one segment, the cycles' places in time.
struct Cycles {
  size_t segment = 0;
  double start_s = 0.0;  ///< of the first cycle
  double period_s = 1.0;
  double begins_s = 0.0;  ///< where on the wanted curve a cycle begins
  size_t count = 0;
  size_t settling = 0;

  /// On the wanted curve.
  [[nodiscard]] double on_curve_s(double run_s) const { return begins_s + run_s - start_s; }
  [[nodiscard]] double start_of(size_t cycle) const {
    return start_s + period_s * static_cast<double>(cycle);
  }
};

[[noreturn]] void refuse_run(const RecordedRun& run, const std::string& place, std::string problem,
                             std::string remedy) {
  throw InputError({run.file, place, std::move(problem), std::move(remedy)});
}

/// How long after a cycle's beginning the wanted curve begins.
double lead_of(const std::string& points, double otherwise_s) {
  const size_t mark = points.find(lead_mark);
  if (mark == std::string::npos) return otherwise_s;
  std::istringstream text(points.substr(mark + lead_mark.size(), 32));
  double lead_s = otherwise_s;
  text >> lead_s;
  return lead_s;
}

Cycles cycles_of(const RecordedRun& run, double period_s, size_t settling) {
  constexpr double same_s = 1e-5;
  constexpr int64_t least_counted = 3;
  for (size_t i = 0; i < run.segments.size(); ++i) {
    const runfile::Segment& segment = run.segments[i];
    if (!run.waveforms.contains(i) || std::abs(segment.period_s - period_s) > same_s) continue;
    const auto begun = static_cast<int64_t>(std::ranges::count_if(
        run.trigger_s, [&](double t) { return t >= segment.start_s && t < segment.end_s(); }));
    const int64_t cycles = std::min(segment.cycles, begun);
    if (cycles < static_cast<int64_t>(settling) + least_counted) {
      refuse_run(run, fmt::format("segment {}", i),
                 fmt::format("has {} cycles, of which {} are left to set in", cycles, settling),
                 fmt::format("Run {} cycles or more.", static_cast<int64_t>(settling) + least_counted));
    }
    double trigger_after_s = run.trigger_delay_s;
    const auto first = std::ranges::lower_bound(run.trigger_s, segment.start_s);
    if (first != run.trigger_s.end()) trigger_after_s = *first - segment.start_s;
    Cycles found{i, segment.start_s, period_s, 0.0, static_cast<size_t>(cycles), settling};
    found.begins_s = -lead_of(run.waveforms.at(i).points, trigger_after_s);
    return found;
  }
  refuse_run(run, "/protocol/segments", fmt::format("has no uploaded waveform of {:g} s", period_s),
             "Give a run of a drive that `diastole shape` wrote for this curve.");
}

PeriodicCurve drive_of(const RecordedRun& run, const Cycles& cycles, Eigen::Index harmonics) {
  const runfile::PlayedWaveform& played = run.waveforms.at(cycles.segment);
  const runfile::Segment& segment = run.segments[cycles.segment];
  std::vector<double> volume_mL;
  for (size_t j = 0; j + 1 < played.fraction.size(); ++j)
    volume_mL.push_back(segment.offset_mL + segment.stroke_mL * played.fraction[j]);
  const auto most = static_cast<Eigen::Index>((volume_mL.size() - 1) / 2);
  PeriodicCurve drive = periodic_curve(volume_mL, cycles.period_s, std::min(harmonics, most)).with(harmonics);
  for (Eigen::Index k = 1; k <= harmonics; ++k)
    drive.c[k] *= std::polar(1.0, -2.0 * pi * drive.frequency_Hz(k) * cycles.begins_s);
  return drive;
}

/// Readings as pressures behind the catheter: gains and drifts of the model undone, and the reading at rest taken off.
struct Pressures {
  std::vector<double> kPa;
  double zero_kPa = 0.0;
};
Pressures behind_catheter(const RecordedRun& run, const DriveModel& model, std::optional<double> zero_kPa) {
  if (!model.model().cavity_traces.empty()) {
    refuse_run(run, "/pressure/cavity_kPa", "is behind a sensor with a memory, which cannot be undone",
               "Measure the volume: add /mr/flow to the run (diastole flow --run).");
  }
  if (run.pump.time_s.empty()) {
    refuse_run(run, "/pump/time_s",
               "holds no position of the pump, so that no rest is known before the motion",
               "Record the pump's position of each run.");
  }
  std::vector<rig::SensorMap> maps;
  for (const rig::SensorMapMaker& make : model.model().cavity_sensor)
    maps.push_back(make(model.place()));
  const auto reading = [&](double pressure_kPa, double time_s) {
    for (const rig::SensorMap& map : maps)
      pressure_kPa = map(pressure_kPa, time_s);
    return pressure_kPa;
  };
  const std::vector<double>& read_kPa = run.pressure.channels.at(runfile::cavity_channel);
  const auto moves =
      std::ranges::find_if(run.pump.commanded_mL, [](double v) { return std::abs(v) > 1e-6; }) -
      run.pump.commanded_mL.begin();
  const double rest_end_s = run.pump.time_s[std::min(static_cast<size_t>(moves), run.pump.time_s.size() - 1)];
  Pressures pressure;
  double sum = 0.0;
  size_t resting = 0;
  for (size_t i = 0; i < read_kPa.size(); ++i) {
    const double time_s = run.pressure.time_s[i];
    double p = read_kPa[i];
    for (int step = 0; step < 3 && !maps.empty(); ++step) {
      constexpr double small_kPa = 1e-3;
      const double slope = (reading(p + small_kPa, time_s) - reading(p, time_s)) / small_kPa;
      p -= (reading(p, time_s) - read_kPa[i]) / slope;
    }
    pressure.kPa.push_back(p);
    if (time_s < rest_end_s && std::isfinite(p)) {
      sum += p;
      ++resting;
    }
  }
  pressure.zero_kPa = zero_kPa.value_or(resting > 0 ? sum / static_cast<double>(resting) : 0.0);
  for (double& p : pressure.kPa)
    p -= pressure.zero_kPa;
  return pressure;
}

/// Harmonics of each cycle's samples.
std::vector<PeriodicCurve> single_cycles(const RecordedRun& run, const std::vector<double>& pressure_kPa,
                                         const Cycles& cycles, Eigen::Index harmonics) {
  std::vector<PeriodicCurve> list;
  for (size_t cycle = 0; cycle < cycles.count; ++cycle) {
    std::vector<double> time_s, values;
    for (size_t i = 0; i < pressure_kPa.size(); ++i) {
      const double at_s = run.pressure.time_s[i];
      if (at_s < cycles.start_of(cycle) || at_s >= cycles.start_of(cycle + 1)) continue;
      if (!std::isfinite(pressure_kPa[i])) continue;
      time_s.push_back(cycles.on_curve_s(at_s));
      values.push_back(pressure_kPa[i]);
    }
    if (values.size() < static_cast<size_t>(3 * harmonics)) {
      list.push_back({cycles.period_s, Eigen::VectorXcd::Constant(1, NAN)});
      continue;
    }
    const std::vector<double> alike(values.size(), 1.0);
    list.push_back(fitted_curve(time_s, values, alike, cycles.period_s, harmonics).curve);
  }
  return list;
}

/// Levels and first harmonics go on in the second half of the run as the first half's straight line says, within
/// what specimens relax and the noise: 3 % of the pressure's range, or five of the line's own errors.
std::optional<size_t> change_in(const std::vector<PeriodicCurve>& cycles, size_t settling, double range_kPa) {
  constexpr double allowed_part = 0.03, errors = 5.0;
  std::vector<size_t> counted;
  for (size_t i = settling; i < cycles.size(); ++i)
    if (std::isfinite(cycles[i].c[0].real())) counted.push_back(i);
  const auto half = static_cast<Eigen::Index>((counted.size() + 1) / 2);
  if (half < 3) return {};
  for (const Eigen::Index harmonic : {0, 1}) {
    const auto size = [&](size_t i) {
      return harmonic == 0 ? cycles[counted[i]].c[0].real() : 2.0 * std::abs(cycles[counted[i]].c[1]);
    };
    Eigen::MatrixXd line(half, 2);
    Eigen::VectorXd seen(half);
    for (Eigen::Index i = 0; i < half; ++i) {
      line.row(i) << 1.0, static_cast<double>(i);
      seen[i] = size(static_cast<size_t>(i));
    }
    const Eigen::Matrix2d unit_covariance = inference::estimate_covariance(line).matrix;
    const Eigen::Vector2d fit = unit_covariance * line.transpose() * seen;
    const double scatter =
        (seen - line * fit).norm() / std::sqrt(static_cast<double>(std::max<Eigen::Index>(half - 2, 1)));
    if (scatter > allowed_part * range_kPa) return counted.front();  // it burst while the line was drawn
    for (size_t i = static_cast<size_t>(half); i < counted.size(); ++i) {
      const Eigen::Vector2d here(1.0, static_cast<double>(i));
      const double sd = scatter * std::sqrt(1.0 + here.dot(unit_covariance * here));
      if (std::abs(size(i) - here.dot(fit)) > std::max(allowed_part * range_kPa, errors * sd))
        return counted[i];
    }
  }
  return {};
}

/// Mean of the cycles that count, and the error of it from their scatter.
MeasuredCurve mean_of(const std::vector<PeriodicCurve>& cycles, size_t settling, Eigen::Index harmonics) {
  Eigen::VectorXcd mean = Eigen::VectorXcd::Zero(harmonics + 1);
  Eigen::VectorXd square = Eigen::VectorXd::Zero(harmonics + 1);
  double count = 0.0, period_s = 1.0;
  Eigen::VectorXcd before;
  for (size_t i = settling; i < cycles.size(); ++i) {
    if (!std::isfinite(cycles[i].c[0].real())) continue;
    period_s = cycles[i].period_s;
    mean += cycles[i].c;
    // Successive cycles: what drifts slowly is no noise.
    if (before.size() > 0) square += 0.5 * (cycles[i].c - before).cwiseAbs2();
    before = cycles[i].c;
    count += 1.0;
  }
  return {{period_s, mean / count}, (square / (std::max(count - 1.0, 1.0) * count)).cwiseSqrt()};
}

Complex catheter_response(const rig::RigModel& model, double frequency_Hz) {
  const double ratio = frequency_Hz / model.catheter.resonance_Hz;
  const Complex second_order = 1.0 / Complex(1.0 - ratio * ratio, 2.0 * model.catheter.damping * ratio);
  return second_order * std::polar(1.0, -2.0 * pi * frequency_Hz * model.sample_delay_s);
}

MeasuredCurve before_catheter(MeasuredCurve pressure, const DriveModel& model) {
  for (Eigen::Index k = 1; k <= pressure.curve.harmonics(); ++k) {
    const Complex lag = catheter_response(model.model(), pressure.curve.frequency_Hz(k));
    pressure.curve.c[k] /= lag;
    pressure.sigma[k] /= std::abs(lag);
  }
  return pressure;
}

/// Errors through the slope of the specimen's curve.
MeasuredCurve volume_by_pressure(const MeasuredCurve& pressure, const DriveModel& model) {
  MeasuredCurve volume{specimen_volume(model, pressure.curve, pressure.curve.harmonics()), pressure.sigma};
  const double mean_mL = volume.curve.c[0].real();
  volume.sigma /= model.model().modulus_kPa * model.model().curve.at(mean_mL).stiffness_kPa_per_mL;
  return volume;
}

/// The shape of /mr/flow with the level that pressure gave.
void take_flow(const RecordedRun& run, const runfile::FlowVolume& flow, const Cycles& cycles,
               MeasuredCurve& volume) {
  std::vector<double> time_s;
  const auto after = std::ranges::lower_bound(run.trigger_s, cycles.start_s);
  const double trigger_after_s = after == run.trigger_s.end() ? 0.0 : *after - cycles.start_s;
  for (const double phase_s : flow.phase_s)
    time_s.push_back(cycles.begins_s + trigger_after_s + phase_s);
  const auto most = static_cast<Eigen::Index>((flow.phase_s.size() - 1) / 2);
  const Eigen::Index harmonics = std::min(volume.curve.harmonics(), most);
  const MeasuredCurve shape = fitted_curve(time_s, flow.cavity_mL, flow.sigma_mL, cycles.period_s, harmonics);
  volume.curve.c.tail(volume.curve.harmonics()).setZero();
  volume.sigma.tail(volume.curve.harmonics()).setConstant(not_measured);
  volume.curve.c.segment(1, harmonics) = shape.curve.c.tail(harmonics);
  volume.sigma.segment(1, harmonics) = shape.sigma.tail(harmonics);
}

}  // namespace

PeriodicCurve drive_from_rest(const DriveModel& model, const GatedRun& run, bool is_first) {
  PeriodicCurve drive = run.drive_mL;
  if (!is_first)
    drive.c[0] += run.cavity_mL.curve.c[0].real() - model.response(drive, 1).cavity_mL.c[0].real();
  return drive;
}

std::string lead_line(double lead_s) { return fmt::format("{}{:.6f}\n", lead_mark, lead_s); }

GatedRun gated_run(const RecordedRun& run, const DriveModel& model, double period_s, Eigen::Index harmonics,
                   std::optional<double> zero_kPa) {
  const Cycles cycles = cycles_of(run, period_s, model.plan().settling);
  const Pressures behind = behind_catheter(run, model, zero_kPa);
  const std::vector<PeriodicCurve> pressure = single_cycles(run, behind.kPa, cycles, harmonics);
  const MeasuredCurve mean = mean_of(pressure, cycles.settling, harmonics);
  if (!std::isfinite(mean.curve.c[0].real()))
    refuse_run(run, "/pressure/cavity_kPa", "holds no whole cycle", "Record the pressure of each run.");
  const MeasuredCurve cavity = before_catheter(mean, model);
  const std::vector<double> cavity_kPa = cavity.curve.at_even(static_cast<size_t>(8 * harmonics + 8));
  GatedRun gated{.file = run.file,
                 .drive_mL = drive_of(run, cycles, harmonics),
                 .cavity_mL = volume_by_pressure(cavity, model),
                 .source = "pressure",
                 .zero_kPa = behind.zero_kPa,
                 .greatest_kPa = std::ranges::max(cavity_kPa),
                 .changed_in_cycle = change_in(pressure, cycles.settling, mean.curve.range())};
  if (const auto flow = run.flow.find(cycles.segment); flow != run.flow.end()) {
    take_flow(run, flow->second, cycles, gated.cavity_mL);
    gated.source = "gated volume";
  }
  return gated;
}

}  // namespace diastole::shaping
