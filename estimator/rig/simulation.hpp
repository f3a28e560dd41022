#pragma once
// Runs the rig's model along a run's motion.

#include <functional>
#include <span>
#include <vector>

#include "estimator/rig/motion.hpp"
#include "estimator/rig/rig_model.hpp"

namespace diastole::rig {

struct SimulationOptions {
  double step_s = 1.0 / 600.0;
  size_t components = 4;  ///< of the hose line (hose_line.hpp)
};

/// What happens in the fluid, evenly spaced in time.
struct PlantTrace {
  double start_s = 0.0;
  double step_s = 0.0;
  std::vector<double> pump_kPa;
  std::vector<double> cavity_kPa;
  std::vector<double> cavity_mL;  ///< taken by the specimen since rest
};

/// What the instruments show at the samples' times.
struct Prediction {
  std::vector<double> cavity_kPa;
  std::vector<double> pump_kPa;
};

/// Cycles that follow each other with one motion.
struct Repetition {
  double start_s = 0.0;
  double period_s = 0.0;
  size_t cycles = 0;
};

/// What a run asks of the simulation.
struct RunDrive {
  Motion motion;
  RunPlace place;
  std::vector<Repetition> repetitions =
      {};  ///< where cycles need not be simulated that are like the one before
  double start_s = 0.0;
  double end_s = 0.0;
  std::function<Motion::State(double time_s)> waveform =
      {};  ///< instead of `motion`, where that is no chain of strokes
};

/// A step near `about_s` that divides the cycles of the run's longest repetition.
double dividing_step(const RunDrive& run, double about_s);

/// The run's motion sampled at these steps: the same for all models.
DriveTrace sampled_motion(const RunDrive& run, double step_s);

/// What the piston does where this motion is commanded.
DriveTrace driven(const RigModel& model, const RunPlace& place, DriveTrace motion);

/// Cycles of a repetition whose period is a whole number of steps are copied once one is like the one before within what
/// could add up to 1e-6 of the pressures' range by the repetition's end.
PlantTrace simulate_plant(const RigModel& model, const RunDrive& run, const SimulationOptions& options = {});
/// The same with `sampled_motion(run, options.step_s)` at hand.
PlantTrace simulate_plant(const RigModel& model, const RunDrive& run, const DriveTrace& motion,
                          const SimulationOptions& options);

/// Catheter, gains, offsets and clocks on a plant's trace, at the samples' times.
Prediction observe(const RigModel& model, const PlantTrace& plant, const RunPlace& place,
                   std::span<const double> sample_s);

}  // namespace diastole::rig
