#include "estimator/rig/simulation.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/rig/catheter.hpp"
#include "estimator/rig/cavity.hpp"
#include "estimator/rig/gas.hpp"
#include "estimator/rig/hose_line.hpp"
#include "estimator/rig/sampled_signal.hpp"

namespace diastole::rig {
namespace {

/// A leak follows the pressure that drives it within some steps, since that pressure holds the leak's own acceleration.
constexpr double leak_following = 0.5;

/// mL/(s kPa) of a leak at the pump that a step of 1/600 s bears: the leak lags by about a step.
constexpr double leak_per_step = 0.016;

/// A gas at the pump is stiff and not linear: its steps are this many times shorter.
constexpr double gas_steps = 4.0;

DriveTrace drive_of(const RigModel& model, const RunDrive& run, double step_s) {
  DriveTrace trace{.start_s = run.start_s,
                   .step_s = step_s,
                   .volume_mL = {},
                   .flow_mL_per_s = {},
                   .acceleration_mL_per_s2 = {}};
  const auto count = static_cast<size_t>(std::ceil((run.end_s - run.start_s) / step_s)) + 2;
  for (size_t k = 0; k < count; ++k) {
    const Motion::Moment moment = run.motion.at(trace.time_s(k));
    trace.volume_mL.push_back(moment.volume_mL);
    trace.flow_mL_per_s.push_back(moment.flow_mL_per_s);
    trace.acceleration_mL_per_s2.push_back(moment.acceleration_mL_per_s2);
  }
  for (const auto& change : model.drive)
    change(trace, run.place);
  return trace;
}

double through(const std::vector<LeakLaw>& leaks, double pressure_kPa, double time_s) {
  double flow = 0.0;
  for (const LeakLaw& leak : leaks)
    flow += leak(pressure_kPa, time_s);
  return flow;
}

/// The loop over time; one run.
class Plant {
 public:
  Plant(const RigModel& model, const RunDrive& run, const SimulationOptions& options)
      : model_(model),
        drive_(drive_of(model, run, options.step_s)),
        gas_(model.pump_gas_mL, model.gas_exponent, run.place.atmosphere_kPa),
        line_(model.hose,
              {.step_s = options.step_s,
               .components = options.components,
               .pump_stiffness = gas_.present() ? std::optional(gas_.stiffness_at_rest()) : std::nullopt}),
        cavity_(model, run.place) {}

  PlantTrace run();

 private:
  [[nodiscard]] double turning_loss_kPa(double flow_mL_per_s) const {
    const double speed = flow_mL_per_s / model_.hose.area_mm2();
    return 0.5e-3 * model_.hose.loss_coefficient * model_.hose.density_kg_m3 * speed * std::abs(speed);
  }
  [[nodiscard]] double left_mL(size_t k) const {
    return (gas_.present() ? line_.entered_mL() : drive_.volume_mL[k] - pump_lost_mL_) - line_.kept_mL();
  }
  [[nodiscard]] EndLoads loads(size_t k, double acceleration) {
    const double flow = line_.entering_mL_per_s();
    EndLoads now;
    cavity_kPa_ = cavity_.look(left_mL(k), drive_.time_s(k));
    now.cavity_kPa = cavity_kPa_ + model_.hose.loss_at_cavity * turning_loss_kPa(line_.leaving_mL_per_s());
    if (gas_.present()) {
      gas_kPa_ = gas_.pressure_kPa(drive_.volume_mL[k] - pump_lost_mL_ - line_.entered_mL());
      now.pump_kPa = gas_kPa_ - (1.0 - model_.hose.loss_at_cavity) * turning_loss_kPa(flow);
    } else {
      now.entering_acceleration = acceleration;
    }
    return now;
  }
  /// The pressure in the cylinder, where the pump's sensor is.
  [[nodiscard]] double cylinder_kPa() const {
    return gas_.present() ? gas_kPa_
                          : line_.pump_kPa() + (1.0 - model_.hose.loss_at_cavity) *
                                                   turning_loss_kPa(line_.entering_mL_per_s());
  }
  void start(PlantTrace& trace);
  void record(PlantTrace& trace, size_t k, double cavity_kPa) const {
    trace.pump_kPa[k] = cylinder_kPa();
    trace.cavity_kPa[k] = cavity_kPa;
    trace.cavity_mL[k] = cavity_.specimen_mL();
  }

  const RigModel& model_;
  DriveTrace drive_;
  GasPocket gas_;
  HoseLine line_;
  Cavity cavity_;
  double pump_lost_mL_ = 0.0;
  double gas_kPa_ = 0.0;
  double cavity_kPa_ = 0.0;
};

PlantTrace Plant::run() {
  const size_t count = drive_.volume_mL.size();
  PlantTrace trace{drive_.start_s, drive_.step_s, std::vector<double>(count), std::vector<double>(count),
                   std::vector<double>(count)};
  const double h = drive_.step_s;
  double leak_flow = 0.0;
  double leak_rate = 0.0;
  for (size_t k = 0; k < count; ++k) {
    EndLoads now = loads(k, drive_.acceleration_mL_per_s2[k] - leak_rate);
    line_.settle(now);
    cavity_.pass(left_mL(k), drive_.time_s(k));
    record(trace, k, cavity_kPa_);
    if (k + 1 == count) break;
    if (!model_.pump_leaks.empty()) {
      const double towards = through(model_.pump_leaks, cylinder_kPa(), drive_.time_s(k));
      leak_rate = leak_following * (towards - leak_flow) / h;
      pump_lost_mL_ += h * (leak_flow + 0.5 * h * leak_rate);
      leak_flow += h * leak_rate;
    }
    // The flow's change over the step is met exactly, whatever the acceleration does within it.
    const double flow_then = drive_.flow_mL_per_s[k + 1];
    const double rise = drive_.acceleration_mL_per_s2[k + 1] - drive_.acceleration_mL_per_s2[k];
    const double mean = (flow_then - drive_.flow_mL_per_s[k]) / h - leak_rate;
    now.entering_acceleration = mean - 0.5 * rise;
    line_.begin_step(now, flow_then - leak_flow);
    line_.end_step(loads(k + 1, mean + 0.5 * rise));
  }
  return trace;
}

}  // namespace

PlantTrace simulate_plant(const RigModel& model, const RunDrive& run, const SimulationOptions& options) {
  SimulationOptions chosen = options;
  if (model.pump_gas_mL > 0.0) chosen.step_s /= gas_steps;
  if (!model.pump_leaks.empty()) {
    const double conductance = through(model.pump_leaks, 1.0, 0.0);
    chosen.step_s /= std::clamp(std::ceil(conductance / leak_per_step), 4.0, 16.0);
  }
  return Plant(model, run, chosen).run();
}

Prediction observe(const RigModel& model, const PlantTrace& plant, const RunPlace& place,
                   std::span<const double> sample_s) {
  const std::vector<double> catheter = through_catheter(model.catheter, plant.cavity_kPa, plant.step_s);
  Prediction seen;
  seen.cavity_kPa.reserve(sample_s.size());
  seen.pump_kPa.reserve(sample_s.size());
  for (const double time_s : sample_s) {
    const double shown_s = time_s * (1.0 - model.sample_skew) - model.sample_delay_s;
    const double place_on_grid = (shown_s - plant.start_s) / plant.step_s;
    double cavity = sampled(catheter, place_on_grid);
    for (const SensorMap& map : model.cavity_sensor)
      cavity = map(cavity, time_s, place);
    seen.cavity_kPa.push_back(cavity + model.cavity_offset_kPa);
    seen.pump_kPa.push_back(sampled(plant.pump_kPa, place_on_grid) + model.pump_offset_kPa);
  }
  return seen;
}

}  // namespace diastole::rig
