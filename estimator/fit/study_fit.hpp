#pragma once
// `diastole fit`: from a study and its measurements to the record that is shown, kept and reported.

#include <functional>

#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/fit.hpp"
#include "estimator/io/fit_file.hpp"
#include "estimator/io/measurement.hpp"
#include "estimator/io/study.hpp"

namespace diastole {

struct StudyFitOptions {
  int iteration_limit = 50;
  Robustness robustness = Robustness::if_needed;
  std::optional<double> pressure_offset_sigma_kPa = {};  ///< seek a common offset of the pressures
  /// The study's shape is that of an image under load (imaged_at_kPa): the body without it is found with the parameters.
  bool unload = false;
  /// Standard deviations of errors that the whole body has alike (considered_errors.hpp); the estimate's errors then hold them.
  double fibre_sigma_deg = 0.0;
  double geometry_sigma_mm = 0.0;
  /// Corrects the motion by what twice as many elements each way change at the estimate, and fits again (finer_mesh.hpp).
  bool finer_mesh = false;
  /// By a loop of pressure against volume that was measured apart from the tags (work_energy.hpp).
  std::optional<MeasuredWork> work = {};
  bool profile = false;  ///< profile intervals of whole parameters
  std::optional<PosteriorOptions> posterior = {};
  std::optional<FitRecord> start = {};  ///< an earlier result or a checkpoint to start from
  /// Called at each accepted step with a record that `start` can take up.
  std::function<void(const FitRecord&)> on_checkpoint = {};
  std::function<bool()> interrupted = {};  ///< asked after each step: true ends the search
  std::function<void(const FitIteration&)> on_iteration;
};

/// The record of a fit that was not begun because its data cannot be what they say.
FitRecord refused_fit(const Study& study, const Measurement& measurement, std::vector<Finding> findings);

/// fit_motion, begun with a stiffer material where the start values carry no equilibrium; a remark says so.
FitOutcome fit_from_current_values(MotionModel& motion, EstimatedParameters& estimated,
                                   const Measurement& measurement, const FitOptions& options,
                                   std::vector<std::string>& remarks);

/// How far outside the specimen a point may lie and still be its own.
LocatorOptions locator_for(const Specimen& specimen);

/// Throws InputError for a start whose parameters are not the study's, for studies that cannot be modelled
/// (study_model.hpp), hold no loaded point, or hardly one on the specimen (usable_points.hpp).
/// Likewise for a work that the study's body cannot take, and for a finer mesh of an unloaded body or of values that vary by element.
/// Where the start values carry no equilibrium, the fit begins with a stiffer material and says so in a remark.
/// Numerical trouble is reported by `converged` and `reason` of the record.
FitRecord fit_study(const Study& study, const Measurement& measurement, const StudyFitOptions& options);

}  // namespace diastole
