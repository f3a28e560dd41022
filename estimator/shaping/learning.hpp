#pragma once
// Iterative learning of a drive (D. A. Bristow et al., IEEE Control Systems 26 (2006) 96) in the harmonics of its period.
//
// All runs together first correct the model's effects (model_fit.hpp). The rig then answers drive U with volumes Y_k = c_k M_k(U) + d_k, M the
// corrected model's answer; c_k = 1 +- 0.1 and d_k = 0 +- 0.5 % of the wanted range before any run, and all runs give their
// posterior, a Gaussian in two complex unknowns a harmonic. From the best run b the next drive is
//
//   U = U_b + (U* - U_b) conj(c) / (|c|^2 + s^2),   M(U*) = wanted - w (Y_b - M(U_b))
//
// s the sd of c: an uncertain gain makes a small step. w = max(0, 1 - sigma^2/|Y_b - M|^2) (J. S. Lim, A. V. Oppenheim, Proc. IEEE 67
// (1979) 1586) leaves to noise what is noise. A harmonic's error is expected to shrink by s / sqrt(|c|^2 + s^2) < 1: learning converges
// monotonically as long as runs do as well, which is what is looked at. The level is apart: a pump that repeats itself cannot hold it
// against a leak, so the next drive begins higher by what the last run lost, up to a quarter of the range.

#include <functional>
#include <optional>
#include <string>

#include "estimator/shaping/gated_run.hpp"

namespace diastole::shaping {

/// One run against the wanted curve.
struct Iteration {
  std::string run;
  std::string source;
  double nrmse = 0.0;           ///< root mean square error about the mean, over the wanted range
  double floor = 0.0;           ///< of it, what noise alone makes
  double level_error_mL = 0.0;  ///< mean volume less the wanted one
  double level_sd_mL = 0.0;     ///< of that measurement
  double surprise = 0.0;        ///< root mean square of what came less what was expected, over the range;
                                ///< the model is that of all runs, this one included
  PeriodicCurve drive_mL = {}, cavity_mL = {};
};

/// A value of the corrected model.
struct LearnedValue {
  std::string effect, parameter;
  double value = 0.0;
};

/// What runs have taught at one frequency.
struct LearnedHarmonic {
  double frequency_Hz = 0.0;
  double gain = 1.0, phase_deg = 0.0;  ///< of c
  double gain_sd = 0.0;
  double contraction_expected = 0.0;  ///< of the next run's error over the best one's
  std::optional<double>
      contraction_found;  ///< of the last two runs, where the error was above twice its noise
};

enum class Ending {
  none,       ///< another run is worth while
  floor,      ///< what is left is noise
  converged,  ///< what is left cannot be taken off: by the pump's limits, or harmonics that the drive has not
  diverging,  ///< two runs in a row were worse than the best
  changed,    ///< the specimen or the rig is not what it was
};
std::string in_words(Ending ending);

struct Lesson {
  std::vector<Iteration> iterations;
  std::vector<LearnedHarmonic> harmonics;
  std::vector<LearnedValue> model;
  std::optional<size_t> best;  ///< of the iterations before a change
  Ending ending = Ending::none;
  std::string reason;         ///< why it ended
  PeriodicCurve drive_mL;     ///< the next one, or the best one's if it has ended
  PeriodicCurve expected_mL;  ///< volume with it
  double greatest_kPa = 0.0;  ///< that the specimen is expected to hold with it
  bool bounded = false;       ///< bounds or the guard against pushing hold it back
  bool guarded = false;       ///< of them the guard
};

/// The drive that the pump can do whose volume is nearest, by the volume's derivatives (DriveModel::jacobian).
using Bound = std::function<PeriodicCurve(const PeriodicCurve& drive_mL, const Eigen::MatrixXd& slope)>;

/// `first_mL`: the drive by the model alone, whose harmonics all later ones have. `runs` in their order; none: the first drive.
Lesson learn(const DriveModel& model, const PeriodicCurve& wanted_mL, const PeriodicCurve& first_mL,
             const std::vector<GatedRun>& runs, const Bound& bound);

}  // namespace diastole::shaping
