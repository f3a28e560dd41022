#include "estimator/rig/simulation.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>

#include "estimator/rig/cavity.hpp"
#include "estimator/rig/hose_line.hpp"
#include "estimator/rig/pump_end.hpp"
#include "estimator/rig/sampled_signal.hpp"

namespace diastole::rig {
namespace {

/// A line whose first resonance is slower than this has twice the components: strokes move its higher ones, too.
constexpr double slow_quarter_wave_Hz = 3.0;
/// A gas at the pump is not linear: its steps are this many times shorter. So are those of a leak that is not in proportion to the
/// pressure, which the line takes for a load.
constexpr double gas_steps = 2.0, leak_steps = 4.0;

void add_turning_errors(const std::array<TurningError, 2>& errors, double turn_mL, DriveTrace& trace) {
  const auto& [once, twice] = errors;
  if (std::ranges::all_of(errors,
                          [](const TurningError& e) { return e.sine_mL == 0.0 && e.cosine_mL == 0.0; }))
    return;
  const double per_mL = 2.0 * std::numbers::pi / turn_mL;
  for (size_t k = 0; k < trace.volume_mL.size(); ++k) {
    const double sine = std::sin(per_mL * trace.volume_mL[k]), cosine = std::cos(per_mL * trace.volume_mL[k]);
    const double sine_2 = 2.0 * sine * cosine, cosine_2 = 1.0 - 2.0 * sine * sine;
    const double value = once.sine_mL * sine + once.cosine_mL * (1.0 - cosine) + twice.sine_mL * sine_2 +
                         twice.cosine_mL * (1.0 - cosine_2);
    const double slope = per_mL * (once.sine_mL * cosine + once.cosine_mL * sine +
                                   2.0 * (twice.sine_mL * cosine_2 + twice.cosine_mL * sine_2));
    const double bend = per_mL * per_mL *
                        (once.cosine_mL * cosine - once.sine_mL * sine +
                         4.0 * (twice.cosine_mL * cosine_2 - twice.sine_mL * sine_2));
    const double flow = trace.flow_mL_per_s[k];
    trace.volume_mL[k] += value;
    trace.flow_mL_per_s[k] += slope * flow;
    trace.acceleration_mL_per_s2[k] += slope * trace.acceleration_mL_per_s2[k] + bend * flow * flow;
  }
}

/// The fluid-filled catheter with its transducer, exactly integrated for pressure that is linear between samples; from rest
/// at the first pressure.
std::vector<double> through_catheter(const Catheter& catheter, std::span<const double> pressure_kPa,
                                     double step_s) {
  const double omega = 2.0 * std::numbers::pi * catheter.resonance_Hz;
  Eigen::Matrix4d grown = Eigen::Matrix4d::Zero();
  grown(0, 1) = step_s;
  grown(1, 0) = -omega * omega * step_s;
  grown(1, 1) = -2.0 * catheter.damping * omega * step_s;
  grown(1, 2) = omega * omega * step_s;
  grown(2, 3) = 1.0;
  const Eigen::Matrix4d exponential = grown.exp();
  const Eigen::Matrix2d flow = exponential.topLeftCorner<2, 2>();
  const Eigen::Vector2d from_end = exponential.block<2, 1>(0, 3);
  const Eigen::Vector2d from_start = exponential.block<2, 1>(0, 2) - from_end;

  std::vector<double> shown(pressure_kPa.size());
  Eigen::Vector2d state(pressure_kPa.empty() ? 0.0 : pressure_kPa.front(), 0.0);
  for (size_t k = 0; k < pressure_kPa.size(); ++k) {
    if (k > 0) state = flow * state + from_start * pressure_kPa[k - 1] + from_end * pressure_kPa[k];
    shown[k] = state[0];
  }
  return shown;
}

/// Cycles of the drive that are alike, in steps: from each k in [first, last) to k + length it repeats itself.
struct RepeatedSteps {
  size_t first = 0, last = 0, length = 0;
};

std::vector<RepeatedSteps> repeated_steps(const RunDrive& run, const DriveTrace& drive) {
  // Far below what moves a pressure by a pascal.
  constexpr double same_mL = 1e-6, same_mL_s = 1e-4, same_mL_s2 = 1e-2, whole = 1e-3;
  std::vector<RepeatedSteps> list;
  for (const Repetition& repetition : run.repetitions) {
    const double steps = repetition.period_s / drive.step_s;
    const auto length = static_cast<size_t>(std::lround(steps));
    const double cycles = static_cast<double>(repetition.cycles);
    if (length == 0 || std::abs(steps - std::round(steps)) * cycles > whole) continue;
    const double start = std::max((repetition.start_s - drive.start_s) / drive.step_s, 0.0);
    auto first = static_cast<size_t>(std::ceil(start));
    const size_t end = std::min(first + length * (repetition.cycles - 1), drive.volume_mL.size());
    const auto repeats = [&](size_t k) {
      const auto alike = [&](const std::vector<double>& values, double same) {
        return k + length < values.size() && std::abs(values[k + length] - values[k]) <= same;
      };
      return alike(drive.volume_mL, same_mL) && alike(drive.flow_mL_per_s, same_mL_s) &&
             alike(drive.acceleration_mL_per_s2, same_mL_s2);
    };
    while (first < end && !repeats(first))  // how the motion sets in is spread over its first steps
      ++first;
    size_t last = first;
    while (last < end && repeats(last))
      ++last;
    if (last > first + length) list.push_back({first, last, length});
  }
  return list;
}

/// The loop over time; one run.
class Plant {
 public:
  Plant(const RigModel& model, const RunDrive& run, const DriveTrace& motion,
        const SimulationOptions& options)
      : model_(model),
        drive_(driven(model, run.place, motion)),
        pump_(model, run.place, options.step_s),
        line_(model.hose, {.step_s = options.step_s,
                           .components = options.components,
                           .pump_stiffness = pump_.stiffness(),
                           .pump_resistance = pump_.resistance()}),
        cavity_(model, run.place),
        repeated_(repeated_steps(run, drive_)) {
    for (const LossMaker& make : model.pump_losses)
      losses_.push_back(make(run.place));
  }

  PlantTrace run();
  /// By how much a loss at the ends overshoots in a step if the flow were as fast as the piston makes it. Such a load is
  /// explicit; steps blow up from 4.5 on.
  [[nodiscard]] double loss_overshoot() const {
    double fastest = 0.0;
    for (const double flow : drive_.flow_mL_per_s)
      fastest = std::max(fastest, std::abs(flow));
    const Hose& hose = model_.hose;
    const double area = hose.area_mm2();
    const double turning = 1e-3 * hose.loss_coefficient * hose.density_kg_m3 * fastest / (area * area);
    const double resistance = turning + steepest_loss_kPa_s_per_mL(fastest);
    return resistance * line_.outflow_by_suction() * drive_.step_s;
  }

 private:
  /// Of the laws of loss at the pump, up to this flow either way.
  [[nodiscard]] double steepest_loss_kPa_s_per_mL(double fastest_mL_per_s) const {
    constexpr int parts = 32;
    const double step = fastest_mL_per_s / parts;
    if (losses_.empty() || step == 0.0) return 0.0;
    double steepest = 0.0;
    for (const double volume_mL : {0.0, std::ranges::max(drive_.volume_mL)})
      for (int i = -parts; i < parts; ++i)
        steepest = std::max(
            steepest,
            std::abs(lost_kPa((i + 1) * step, volume_mL, 0.0) - lost_kPa(i * step, volume_mL, 0.0)) / step);
    return steepest;
  }
  [[nodiscard]] double lost_kPa(double flow_mL_per_s, double volume_mL, double time_s) const {
    double loss = 0.0;
    for (const LossLaw& law : losses_)
      loss += law(flow_mL_per_s, volume_mL, time_s);
    return loss;
  }
  [[nodiscard]] double turning_loss_kPa(double flow_mL_per_s) const {
    const double speed = flow_mL_per_s / model_.hose.area_mm2();
    return 0.5e-3 * model_.hose.loss_coefficient * model_.hose.density_kg_m3 * speed * std::abs(speed);
  }
  [[nodiscard]] double left_mL(size_t k) const {
    return drive_.volume_mL[k] + line_.yielded_mL() - line_.kept_mL();
  }
  [[nodiscard]] double loss_at_pump_kPa(size_t k) const {
    const double flow = line_.entering_mL_per_s();
    return (1.0 - model_.hose.loss_at_cavity) * turning_loss_kPa(flow) +
           lost_kPa(flow, cavity_.specimen_mL(), drive_.time_s(k) - copied_s_);
  }
  [[nodiscard]] EndLoads loads(size_t k, double acceleration) {
    cavity_kPa_ = cavity_.look(left_mL(k), drive_.time_s(k) - copied_s_);
    EndLoads now{
        .piston_acceleration = acceleration, .pump_kPa = -loss_at_pump_kPa(k), .cavity_kPa = cavity_kPa_};
    now.cavity_kPa += model_.hose.loss_at_cavity * turning_loss_kPa(line_.leaving_mL_per_s());
    if (!pump_.leaks())
      pump_load_kPa_ =
          pump_.load_kPa(line_.yielded_mL(), line_.yielding_mL_per_s(), drive_.time_s(k) - copied_s_);
    now.pump_kPa += pump_load_kPa_;
    return now;
  }
  /// At the end of a step, as predicted and for good: the load is that of the state which it makes.
  void meet_leaks(size_t k) {
    if (!pump_.leaks()) return;
    const double missing =
        pump_.missing_load_kPa(line_.yielded_mL(), line_.yielding_mL_per_s(), pump_load_kPa_,
                               line_.yield_by_load(), drive_.time_s(k) - copied_s_);
    line_.add_pump_load(missing);
    pump_load_kPa_ += missing;
  }
  /// The pressure in the cylinder, where the pump's sensor is.
  [[nodiscard]] double cylinder_kPa(size_t k) const { return line_.pump_kPa() + loss_at_pump_kPa(k); }
  void record(PlantTrace& trace, size_t k, double cavity_kPa) const {
    trace.pump_kPa[k] = cylinder_kPa(k);
    trace.cavity_kPa[k] = cavity_kPa;
    trace.cavity_mL[k] = cavity_.specimen_mL();
  }

  /// The step from which to go on as from k: cycles between are filled in.
  [[nodiscard]] size_t beyond_repeated(PlantTrace& trace, size_t k);

  const RigModel& model_;
  DriveTrace drive_;
  std::vector<LossLaw> losses_;
  PumpEnd pump_;
  HoseLine line_;
  Cavity cavity_;
  std::vector<RepeatedSteps> repeated_;
  double copied_s_ = 0.0;  ///< by which the cavity's time is behind
  double cavity_kPa_ = 0.0;
  double pump_load_kPa_ = 0.0;  ///< of gas, drive and leaks
};

size_t Plant::beyond_repeated(PlantTrace& trace, size_t k) {
  constexpr double adding_up =
      1e-6;  // of the range, in all cycles that are not simulated: searches need smooth models
  const auto at = std::ranges::find_if(repeated_, [&](const RepeatedSteps& steps) {
    return k >= steps.first + 2 * steps.length && k < steps.last;
  });
  if (at == repeated_.end() || (k - at->first) % at->length != 0) return k;
  const size_t length = at->length;
  const size_t cycles = (at->last - k) / length;
  if (cycles == 0) return k;
  const auto has_settled = [&](const std::vector<double>& values) {
    const auto now = values.begin() + static_cast<std::ptrdiff_t>(k);
    const auto cycle = static_cast<std::ptrdiff_t>(length);
    const auto [low, high] = std::minmax_element(now - cycle, now + 1);
    const double most = adding_up * (*high - *low) / static_cast<double>(cycles);
    return std::equal(now - cycle, now + 1, now - 2 * cycle,
                      [&](double a, double b) { return std::abs(a - b) <= most; });
  };
  if (!has_settled(trace.cavity_kPa) || !has_settled(trace.pump_kPa) || !has_settled(trace.cavity_mL))
    return k;
  const size_t beyond = k + cycles * length;
  for (std::vector<double>* values : {&trace.cavity_kPa, &trace.pump_kPa, &trace.cavity_mL})
    for (size_t j = k + 1; j <= beyond; ++j)
      (*values)[j] = (*values)[j - length];
  copied_s_ += static_cast<double>(cycles * length) * drive_.step_s;
  return beyond;
}

PlantTrace Plant::run() {
  const size_t count = drive_.volume_mL.size();
  PlantTrace trace{drive_.start_s + model_.drive_lag_s, drive_.step_s, std::vector<double>(count),
                   std::vector<double>(count), std::vector<double>(count)};
  const double h = drive_.step_s;
  for (size_t k = 0; k < count; ++k) {
    EndLoads now = loads(k, drive_.acceleration_mL_per_s2[k]);
    line_.settle(now);
    cavity_.pass();
    record(trace, k, cavity_kPa_);
    k = beyond_repeated(trace, k);
    if (k + 1 == count) break;
    pump_.pass(trace.pump_kPa[k], drive_.time_s(k) - copied_s_);
    // The flow's change over the step is met exactly, whatever the acceleration does within it.
    const double flow_then = drive_.flow_mL_per_s[k + 1];
    const double rise = drive_.acceleration_mL_per_s2[k + 1] - drive_.acceleration_mL_per_s2[k];
    const double mean = (flow_then - drive_.flow_mL_per_s[k]) / h;
    now.piston_acceleration = mean - 0.5 * rise;
    line_.begin_step(now, flow_then);
    meet_leaks(k + 1);
    line_.end_step(loads(k + 1, mean + 0.5 * rise));
    meet_leaks(k + 1);
  }
  return trace;
}

}  // namespace

DriveTrace driven(const RigModel& model, const RunPlace& place, DriveTrace motion) {
  for (const DriveMap& change : model.turns)
    change(motion, place);
  add_turning_errors(model.turning_errors, place.turn_mL, motion);
  for (const DriveMap& change : model.drive)
    change(motion, place);
  return motion;
}

void DriveTrace::differentiate() {
  const size_t count = volume_mL.size();
  const auto slope = [&](const std::vector<double>& values, size_t k) {
    const size_t before = k > 0 ? k - 1 : 0;
    const size_t after = k + 1 < count ? k + 1 : k;
    return (values[after] - values[before]) / (step_s * static_cast<double>(after - before));
  };
  for (size_t k = 0; k < count; ++k)
    flow_mL_per_s[k] = slope(volume_mL, k);
  for (size_t k = 0; k < count; ++k)
    acceleration_mL_per_s2[k] = slope(flow_mL_per_s, k);
}

CyclePlace cycle_at(const RunPlace& place, double time_s) {
  const auto& starts = place.trigger_s;
  const auto after = std::upper_bound(starts.begin(), starts.end(), time_s);
  const auto begun = static_cast<double>(after - starts.begin());
  CyclePlace at{.done = place.cycles_before + begun};
  if (after == starts.begin() || starts.size() < 2) return at;
  const bool is_last = after == starts.end();  // it lasts as long as the one before
  const double period_s = is_last ? *(after - 1) - *(after - 2) : *after - *(after - 1);
  const double phase = (time_s - *(after - 1)) / period_s;
  if (!is_last) at.done += phase - 1.0;
  if (phase < 1.0) at.phase = phase, at.rate_per_s = 1.0 / period_s;
  return at;
}

double dividing_step(const RunDrive& run, double about_s) {
  const auto length = [](const Repetition& one) { return one.period_s * static_cast<double>(one.cycles); };
  const auto longest = std::ranges::max_element(run.repetitions, {}, length);
  if (longest == run.repetitions.end() || !(longest->period_s > about_s)) return about_s;
  return longest->period_s / std::ceil(longest->period_s / about_s - 1e-6);
}

DriveTrace sampled_motion(const RunDrive& run, double step_s) {
  DriveTrace trace{.start_s = run.start_s,
                   .step_s = step_s,
                   .volume_mL = {},
                   .flow_mL_per_s = {},
                   .acceleration_mL_per_s2 = {}};
  const auto count = static_cast<size_t>(std::ceil((run.end_s - run.start_s) / step_s)) + 2;
  for (size_t k = 0; k < count; ++k) {
    const double time_s = trace.time_s(k);
    const Motion::State state = run.waveform ? run.waveform(time_s) : run.motion.at(time_s);
    trace.volume_mL.push_back(state.volume_mL);
    trace.flow_mL_per_s.push_back(state.flow_mL_per_s);
    trace.acceleration_mL_per_s2.push_back(state.acceleration_mL_per_s2);
  }
  return trace;
}

PlantTrace simulate_plant(const RigModel& model, const RunDrive& run, const SimulationOptions& options) {
  return simulate_plant(model, run, sampled_motion(run, options.step_s), options);
}

PlantTrace simulate_plant(const RigModel& model, const RunDrive& run, const DriveTrace& motion,
                          const SimulationOptions& options) {
  constexpr double most_overshoot = 3.0;
  SimulationOptions finer = options;
  finer.components *= model.hose.wave_speed_m_s < slow_quarter_wave_Hz * 4.0 * model.hose.length_m ? 2 : 1;
  double times_finer =
      std::max(model.pump_gas_mL != 0.0 ? gas_steps : 1.0, model.pump_leaks.empty() ? 1.0 : leak_steps);
  if (times_finer == 1.0) {
    Plant plant(model, run, motion, finer);
    const double overshoot = plant.loss_overshoot();
    if (!(overshoot > most_overshoot)) return plant.run();
    times_finer = std::ceil(overshoot / most_overshoot);
  }
  finer.step_s /= times_finer;
  return Plant(model, run, sampled_motion(run, finer.step_s), finer).run();
}

Prediction observe(const RigModel& model, const PlantTrace& plant, const RunPlace& place,
                   std::span<const double> sample_s) {
  std::vector<double> catheter = through_catheter(model.catheter, plant.cavity_kPa, plant.step_s);
  for (const SensorTraceMap& map : model.cavity_traces)
    map(catheter, plant.start_s, plant.step_s, place);
  std::vector<SensorMap> maps;
  for (const SensorMapMaker& make : model.cavity_sensor)
    maps.push_back(make(place));
  Prediction seen;
  seen.cavity_kPa.reserve(sample_s.size());
  seen.pump_kPa.reserve(sample_s.size());
  for (const double time_s : sample_s) {
    const double shown_s = time_s * (1.0 - model.sample_skew) - model.sample_delay_s;
    const double place_on_grid = (shown_s - plant.start_s) / plant.step_s;
    double cavity = sampled(catheter, place_on_grid);
    for (const SensorMap& map : maps)
      cavity = map(cavity, time_s);
    seen.cavity_kPa.push_back(cavity + model.cavity_offset_kPa);
    seen.pump_kPa.push_back(sampled(plant.pump_kPa, place_on_grid) + model.pump_offset_kPa);
  }
  return seen;
}

}  // namespace diastole::rig
