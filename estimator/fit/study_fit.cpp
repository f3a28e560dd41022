#include "estimator/fit/study_fit.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "estimator/fit/estimated_parameters.hpp"
#include "estimator/fit/finer_mesh.hpp"
#include "estimator/fit/fit_remarks.hpp"
#include "estimator/fit/fit_sections.hpp"
#include "estimator/fit/study_motion.hpp"
#include "estimator/fit/unloaded_motion.hpp"
#include "estimator/fit/usable_points.hpp"
#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/io/study_fingerprint.hpp"
#include "estimator/io/study_refusal.hpp"
#include "estimator/model/affected_model.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/model/unloaded_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr double outlier_sigma = 5.0;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// Of an element through the wall; of a mesh from a file it is not known: the least extrapolation.
double element_mm(const Specimen& specimen) {
  if (const auto* annulus = std::get_if<AnnulusSpecimen>(&specimen))
    return (annulus->outer_radius_mm - annulus->inner_radius_mm) / annulus->mesh[2];
  if (const auto* ellipsoid = std::get_if<EllipsoidSpecimen>(&specimen))
    return (ellipsoid->outer_axes_mm[0] - ellipsoid->inner_axes_mm[0]) / ellipsoid->mesh[2];
  return 4.0 * farthest_outside_mm;
}

std::string data_words(const Measurement& measurement) {
  if (measurement.points.empty()) return "tags";
  return measurement.tags.empty() ? "points" : "tags and points";
}

FittedParameter record_of(const ParameterRun& run, const FitOutcome& fit) {
  const auto& [parameter, first, count, is_modulus] = run;
  FittedParameter result{.name = parameter.name,
                         .value = fit.values[first].value,
                         .se = fit.values[first].se,
                         .ci95 = fit.values[first].ci95,
                         .start = parameter.start,
                         .bounds = {parameter.lower, parameter.upper},
                         .at_bound = fit.values[first].at_lower   ? "lower"
                                     : fit.values[first].at_upper ? "upper"
                                                                  : "",
                         .elements = {},
                         .smoothness = {}};
  for (const SmoothOutcome& smooth : fit.smoothness) {
    if (smooth.first_value == first) result.smoothness = smooth;
  }
  if (parameter.vary == Variation::whole) return result;
  // Regional: the mean with its error from the joint covariance, which is far smaller than any element's own.
  double sum = 0;
  result.at_bound = "";
  for (size_t i = first; i < first + count; ++i) {
    sum += fit.values[i].value;
    result.elements.push_back({fit.values[i].value, fit.values[i].se, fit.values[i].ci95});
    if (fit.values[i].at_lower) result.at_bound = "lower";
    if (fit.values[i].at_upper) result.at_bound = "upper";
  }
  result.value = sum / static_cast<double>(count);
  result.se = run.se_of_mean(fit.covariance);
  // The elements on a bound have no error of their own: the mean's is that of the others.
  if (!(result.se > 0)) result.se = unknown;
  result.ci95 = {result.value - inference::normal_95 * result.se,
                 result.value + inference::normal_95 * result.se};
  return result;
}

/// Profile and posterior of a whole parameter.
void record_shape(FittedParameter& parameter, const FitOutcome& fit, size_t place) {
  if (!parameter.elements.empty()) return;
  for (const ProfileInterval& profile : fit.profiles) {
    if (profile.place == place && profile.found) parameter.profile = profile;
  }
  parameter.variance_shares = fit.values[place].shares;
  if (fit.posterior) parameter.posterior = fit.posterior->values[place];
}

void record_parameters(FitRecord& record, const EstimatedParameters& estimated, const FitOutcome& fit) {
  std::vector<size_t> places;
  for (const ParameterRun& run : estimated.runs) {
    places.push_back(run.first);
    record.parameters.push_back(record_of(run, fit));
    record_shape(record.parameters.back(), fit, run.first);
  }
  record.correlation.names = fit.unknown_names;
  const Eigen::MatrixXd matrix = inference::correlation(fit.covariance);
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    const Eigen::VectorXd values = matrix.row(row);
    record.correlation.matrix.emplace_back(values.begin(), values.end());
  }
  record.directions = directions_of(record, fit, places);
  if (const auto& offset = fit.pressure_offset) {
    record.pressure_offset_kPa = FittedOffset{offset->value_kPa, offset->se_kPa};
    record.remarks.push_back(
        fmt::format("The pressures differ from the true ones by {:+.4f} ± {:.4f} kPa, as far as these data "
                    "tell{}; the parameters' errors hold this.",
                    offset->value_kPa, offset->se_kPa,
                    std::abs(offset->value_kPa) < 2 * offset->se_kPa ? ": consistent with none" : ""));
  }
  if (fit.posterior) record.posterior = *fit.posterior;
  if (const auto& robust = fit.robust)
    record.robust = FittedRobust{robust->loss.degrees, robust->loss.scale, static_cast<size_t>(robust->wild)};
}

FitIteration record_of(const inference::SearchStep& step, const EstimatedParameters& estimated) {
  FitIteration result{step.iteration, step.cost, step.accepted, {}};
  for (const ParameterRun& run : estimated.runs)
    result.parameters.push_back(run.mean(step.q));
  return result;
}

/// Where each whole parameter stands among the values.
std::vector<size_t> whole_values(const EstimatedParameters& estimated) {
  std::vector<size_t> places;
  for (const ParameterRun& run : estimated.runs) {
    if (run.parameter.vary == Variation::whole) places.push_back(run.first);
  }
  return places;
}

void take_start(EstimatedParameters& estimated, const FitRecord& start, const std::string& file) {
  for (const auto& [parameter, first, count, is_modulus] : estimated.runs) {
    const auto found = std::ranges::find(start.parameters, parameter.name, &FittedParameter::name);
    if (found == start.parameters.end() ||
        (found->elements.size() > 1 && count > 1 && found->elements.size() != count)) {
      throw InputError({file, fmt::format("parameter {}", parameter.name),
                        "is not in the result to start from, or has another number of elements there",
                        "Start from a result of the same law and mesh."});
    }
    for (size_t i = 0; i < count; ++i) {
      const double value = count > 1 && !found->elements.empty() ? found->elements[i].value : found->value;
      EstimatedParameter& own = estimated.values[first + i];
      own.start = std::clamp(value, own.lower, own.upper);
    }
  }
}

/// What is known before the search.
FitRecord head_of(const Study& study, const Measurement& measurement) {
  FitRecord record{};
  record.study = study.file.string();
  record.fingerprint = study_fingerprint(study);
  record.law = study.law.name;
  constexpr std::array<const char*, 3> kinds{"annulus", "ellipsoid", "mesh"};
  record.specimen = kinds[study.specimen.index()];
  record.mesh = mesh_of(study.specimen);
  record.data = data_words(measurement);
  record.rms_mm = record.chi2 = record.chi2_per_dof = unknown;
  record.undeformed.chi2_per_residual = record.undeformed.mean_mm = unknown;
  return record;
}

/// Multiplies the stiffnesses at which the search begins, within their bounds; whether one changed. With all of them
/// multiplied by a factor, a body carries the load times that factor.
bool stiffen(EstimatedParameters& estimated) {
  constexpr double factor = 3.0;
  bool changed = false;
  for (const auto& [parameter, first, count, is_modulus] : estimated.runs) {
    for (size_t i = first; is_modulus && i < first + count; ++i) {
      EstimatedParameter& value = estimated.values[i];
      const double stiffer = std::clamp(factor * value.start, value.lower, value.upper);
      changed = changed || stiffer > value.start;
      value.start = std::max(value.start, stiffer);
    }
  }
  return changed;
}

std::string start_words(const EstimatedParameters& estimated) {
  std::string words;
  for (const ParameterRun& run : estimated.runs) {
    if (run.is_modulus)
      words += fmt::format("{}{} = {:.4g}", words.empty() ? "" : ", ", run.parameter.name,
                           estimated.values[run.first].start);
  }
  return words;
}

/// A result that has only got so far: values without errors.
FitRecord checkpoint_of(FitRecord record, const inference::SearchStep& step,
                        const EstimatedParameters& estimated) {
  record.reason = fmt::format("Checkpoint after iteration {}.", step.iteration);
  record.iterations = step.iteration;
  for (const ParameterRun& run : estimated.runs) {
    const auto& [parameter, first, count, is_modulus] = run;
    FittedParameter& reached = record.parameters.emplace_back();
    reached.name = parameter.name;
    reached.value = run.mean(step.q);
    reached.se = unknown;
    reached.ci95 = {unknown, unknown};
    reached.start = parameter.start;
    reached.bounds = {parameter.lower, parameter.upper};
    for (size_t i = 0; parameter.vary == Variation::element && i < count; ++i)
      reached.elements.push_back({step.q[static_cast<Eigen::Index>(first + i)], unknown, {unknown, unknown}});
  }
  return record;
}

void record_frames(FitRecord& record, const FitOutcome& fit) {
  size_t tags_outside = 0, tags_unfollowed = 0, points_left_out = 0;
  double squares_mm2 = 0;
  for (const EstimatedFrame& frame : fit.frames) {
    const auto rows = static_cast<double>(frame.weighted.size());
    record.frames.push_back({.frame = frame.number,
                             .time_s = frame.load.time_s,
                             .measured_kPa = frame.load.pressure_kPa,
                             .sigma_kPa = frame.load.sigma_kPa,
                             .estimated_kPa = frame.pressure_kPa,
                             .se_kPa = frame.se_kPa,
                             .points = frame.found.usable,
                             .rms_mm = std::sqrt(frame.unweighted_mm.squaredNorm() / rows),
                             .chi2_per_point = frame.weighted.squaredNorm() / rows});
    squares_mm2 += frame.unweighted_mm.squaredNorm();
    record.residuals_used += static_cast<size_t>(frame.weighted.size());
    record.outliers_5sigma += static_cast<size_t>((frame.weighted.array().abs() > outlier_sigma).count());
    tags_outside += frame.found.tags_left_out - frame.found.tags_unfollowed;
    tags_unfollowed += frame.found.tags_unfollowed;
    points_left_out += frame.found.points_left_out;
  }
  record.rms_mm = std::sqrt(squares_mm2 / static_cast<double>(record.residuals_used));
  if (tags_outside > 0) {
    record.excluded.push_back(
        {fmt::format("tag points farther than about {} mm from the body", farthest_outside_mm),
         tags_outside});
  }
  if (tags_unfollowed > 0) {
    record.excluded.push_back(
        {"wild tag points, so far off that their line of error does not meet their tag plane on the body",
         tags_unfollowed});
  }
  if (points_left_out > 0) {
    record.excluded.push_back(
        {fmt::format("3-D points whose undeformed place is farther than about {} mm from the body",
                     farthest_outside_mm),
         points_left_out});
  }
}

ResidualHistogram histogram_of(const FitOutcome& fit) {
  constexpr int bins = 40;
  constexpr double reach = 5.0, width = 2 * reach / bins;
  ResidualHistogram histogram;
  for (int i = 0; i <= bins; ++i)
    histogram.edges.push_back(-reach + i * width);
  histogram.counts.assign(bins, 0.0);
  for (const EstimatedFrame& frame : fit.frames) {
    for (const double residual : frame.weighted) {
      const double clamped = std::clamp(residual, -reach, reach - width / 2);
      histogram.counts[static_cast<size_t>((clamped + reach) / width)] += 1;
    }
  }
  return histogram;
}

// At rest a tag point must lie on its own plane, and a 3-D point at its own place.
void record_undeformed(FitRecord& record, const Measurement& measurement) {
  double sum_mm = 0, chi2 = 0;
  size_t rows = 0;
  const auto add = [&](double error_mm, double sigma_mm) {
    sum_mm += error_mm;
    chi2 += error_mm * error_mm / (sigma_mm * sigma_mm);
    ++rows;
  };
  for (const TagPoint& tag : measurement.tags) {
    if (tag.frame != 0) continue;
    ++record.undeformed.points;
    double along_mm = -tag.plane_mm;
    for (size_t k = 0; k < 3; ++k)
      along_mm += tag.normal[k] * tag.x_mm[k];
    add(along_mm, tag.sigma_mm);
  }
  for (const ObservedPoint& point : measurement.points) {
    if (point.frame != 0) continue;
    ++record.undeformed.points;
    for (size_t k = 0; k < 3; ++k)
      add(point.x_mm[k] - point.X_mm[k], point.sigma_mm);
  }
  const double count = static_cast<double>(rows);
  record.undeformed.residuals = rows;
  record.undeformed.mean_mm = rows > 0 ? sum_mm / count : unknown;
  record.undeformed.chi2_per_residual = rows > 0 ? chi2 / count : unknown;
}

/// The body without load at the estimate, and whether the load brings the image back.
void record_unloading(FitRecord& record, UnloadedMotion& motion, const FitOutcome& fit) {
  std::vector<double> values;
  for (const EstimatedValue& value : fit.values)
    values.push_back(value.value);
  const ImagedLoad measured = motion.imaged_load().value();
  const EstimatedPressure pressure = fit.imaged_pressure.value();
  const auto again = motion.inflated_again(values, pressure.value_kPa);
  if (!again) {
    record.remarks.push_back(fmt::format(
        "No shape without load is found at the estimate ({:.4g} kPa in the image). These parameters and the "
        "pressure of the image do not belong together.",
        pressure.value_kPa));
    return;
  }
  const bool returned = again->back.returned(motion.mesh());
  record.unloaded = FittedUnloading{
      measured.pressure_kPa,   measured.sigma_kPa,        pressure.value_kPa,      pressure.se_kPa,
      again->cavity_imaged_mL, again->cavity_unloaded_mL, again->back.farthest_mm, returned};
  if (!returned) {
    record.remarks.push_back(fmt::format(
        "The body without load does not come back to its image: {}, {:.3g} mm off. These parameters and the "
        "pressure of the image do not belong together.",
        again->back.report.describe(), again->back.farthest_mm));
  }
}

/// The errors of fibres and walls that were stated. Throws InputError where they cannot be followed.
std::vector<ConsideredError> considered_by(const Study& study, const ElasticModel& model,
                                           const StudyFitOptions& options) {
  if (options.fibre_sigma_deg == 0.0 && options.geometry_sigma_mm == 0.0) return {};
  if (options.unload)
    throw InputError({study.file.string(), "--unload",
                      "stands beside errors of fibres or walls, which are followed in a body "
                      "that is free of stress in its image only",
                      "Leave out --fibre-sigma-deg and --geometry-sigma-mm."});
  require_plain(study, "errors of fibres and walls are followed");
  if (options.fibre_sigma_deg > 0.0 && !model.system().material_axes())
    throw InputError({study.file.string(), "--fibre-sigma-deg", "is given for a body without fibres",
                      "Leave it out, or give the specimen fibres."});
  std::vector<ConsideredError> errors = fibre_errors(model, options.fibre_sigma_deg);
  for (ConsideredError& error : geometry_errors(model, options.geometry_sigma_mm))
    errors.push_back(std::move(error));
  return errors;
}

/// Throws InputError where the cavity's pressure is not all that works on the body, or frame 0 is not as the model takes it.
void require_takes_work(const Study& study, const ElasticModel& model, const StudyFitOptions& options) {
  if (!options.work) return;
  if (study.imaged_at && !options.unload)
    refuse(study, "specimen.imaged_at_kPa",
           "the work of --energy is counted from the shape of the image, which was under load",
           "Add --unload, so that the load is known to the model too.");
  if (study.chamber)
    refuse(study, "chamber", "the fluid around the specimen takes part of the work of --energy",
           "Leave --energy out.");
  require_closed_cavity(study, model);
}

}  // namespace

// Extrapolation beyond an element, as a fraction of it: `farthest_outside_mm` through the wall, never more than an
// element.
LocatorOptions locator_for(const Specimen& specimen) {
  return {.outside_xi = std::clamp(farthest_outside_mm / element_mm(specimen), 0.25, 1.0)};
}

/// On another mesh an element's own value has no meaning, and a shape that was imaged under load would be another one.
void require_finer_mesh(const Study& study, const StudyFitOptions& options) {
  const bool regional = std::ranges::any_of(study.law.parameters, [](const StudyParameter& parameter) {
    return parameter.vary == Variation::element;
  });
  if (options.finer_mesh && (regional || options.unload))
    throw InputError({study.file.string(), "--finer-mesh",
                      regional
                          ? "corrects values of the whole specimen, and a parameter has vary = \"element\""
                          : "does not go together with --unload",
                      "Leave one of them out, or give the study itself more elements."});
}

/// The correction at the estimate by the study on a finer mesh.
std::optional<Eigen::VectorXd> correction_by_finer_mesh(const Study& study,
                                                        const EstimatedParameters& estimated,
                                                        const HermiteMesh& mesh, const JointProblem& problem,
                                                        const Eigen::VectorXd& q) {
  const Study finer = on_finer_mesh(study);
  const std::unique_ptr<ElasticMotion> motion =
      study_motion(finer, make_affected_model(finer), estimated.groups, false);
  std::vector<const MotionResiduals*> parts;
  std::vector<NodeField> position_mm;
  for (const JointProblem::LoadedFrame& frame : problem.frames()) {
    parts.push_back(&frame.residuals);
    position_mm.push_back(frame.position_mm);
  }
  std::vector<double> values = problem.space().values(q);
  values.resize(static_cast<size_t>(problem.values()));
  return finer_mesh_correction(*motion, {mesh, position_mm, values, problem.pressures_at(q)},
                               MotionResiduals::joined(parts), locator_for(study.specimen));
}

FitRecord refused_fit(const Study& study, const Measurement& measurement, std::vector<Finding> findings) {
  FitRecord record = head_of(study, measurement);
  record.reason = "Not fitted: the data cannot be what they say.";
  record.findings = std::move(findings);
  return record;
}

/// Of a body with fibres on few elements whose own error nobody has asked for.
bool has_unseen_mesh_error(const Study& study, const ElasticModel& model, const StudyFitOptions& options) {
  constexpr size_t few =
      48;  // 8 x 4 x 2 bias the values of lv-a by a third of their errors, 6 x 3 x 1 by three to five of them
  return model.law().needs_axes() && !options.finer_mesh && !options.unload &&
         model.mesh().element_count() < few &&
         std::ranges::none_of(study.law.parameters, [](const StudyParameter& parameter) {
           return parameter.vary == Variation::element;
         });
}

FitOutcome fit_from_current_values(MotionModel& motion, EstimatedParameters& estimated,
                                   const Measurement& measurement, const FitOptions& options,
                                   std::vector<std::string>& remarks) {
  const std::string given = start_words(estimated);
  FitOutcome fit = fit_motion(motion, estimated.values, measurement, options);
  const auto failed_at_start = [&] { return !fit.converged() && fit.history.empty(); };
  if (!failed_at_start()) return fit;
  int solves = fit.forward_solves;
  while (failed_at_start() && stiffen(estimated)) {
    fit = fit_motion(motion, estimated.values, measurement, options);
    fit.forward_solves = solves += fit.forward_solves;
  }
  if (failed_at_start()) {
    fit.reason += fmt::format(
        " Nor is there an equilibrium with {}, as stiff as the bounds allow: widen `bounds`, or see whether "
        "the pressures are in kPa and the lengths in mm.",
        start_words(estimated));
  } else {
    remarks.push_back(fmt::format(
        "With the start values ({}) the body does not carry the pressures: the search began at {} instead.",
        given, start_words(estimated)));
  }
  return fit;
}

namespace {

/// What the study and the command ask of the fit. `study`, `options`, `estimated`, `motion` and `record` outlive it.
FitOptions fit_options_of(const Study& study, const StudyFitOptions& options,
                          const EstimatedParameters& estimated, const ElasticMotion& motion,
                          const FitRecord& record) {
  FitOptions fit_options;
  fit_options.file = study.file.string();
  fit_options.locator = locator_for(study.specimen);
  fit_options.smooth = estimated.smooth;
  fit_options.robustness = options.robustness;
  fit_options.pressure_offset_sigma_kPa = options.pressure_offset_sigma_kPa;
  fit_options.posterior = options.posterior;
  fit_options.work = options.work;
  fit_options.search.interrupted = options.interrupted;
  if (options.finer_mesh)
    fit_options.correction = [&](const JointProblem& problem, const Eigen::VectorXd& q) {
      return correction_by_finer_mesh(study, estimated, motion.mesh(), problem, q);
    };
  if (options.profile) fit_options.profiled = whole_values(estimated);
  fit_options.search.iteration_limit = options.iteration_limit;
  fit_options.on_step = [&](const inference::SearchStep& step) {
    if (options.on_iteration) options.on_iteration(record_of(step, estimated));
    if (options.on_checkpoint && step.accepted) options.on_checkpoint(checkpoint_of(record, step, estimated));
  };
  return fit_options;
}

/// How the search went, whether or not it found anything.
void record_search(FitRecord& record, const FitOutcome& fit, const EstimatedParameters& estimated) {
  record.converged = fit.converged();
  record.reason = fit.reason;
  record.iterations = fit.iterations;
  record.forward_solves = fit.forward_solves;
  record.seconds = fit.seconds;
  for (const inference::SearchStep& step : fit.history)
    record.history.push_back(record_of(step, estimated));
}

void remark_on_mesh(FitRecord& record, const Study& study, const StudyFitOptions& options,
                    const FitOutcome& fit, const ElasticModel& model) {
  if (options.finer_mesh)
    record.remarks.push_back(
        fit.corrected
            ? fmt::format(
                  "Twice as many elements each way change the motion by {:.2g} standard deviations of its "
                  "residuals (RMS): the values are those of that mesh.",
                  *fit.corrected)
            : "On a finer mesh there is no equilibrium at the estimate: the values are those of the study's "
              "mesh.");
  if (has_unseen_mesh_error(study, model, options))
    record.remarks.emplace_back(
        "So few elements bias a ventricle's values, and no error bar knows of it: --finer-mesh corrects "
        "them.");
}

}  // namespace

FitRecord fit_study(const Study& study, const Measurement& measurement, const StudyFitOptions& options) {
  require_loaded_points(study, measurement);
  ElasticModel model = make_affected_model(study);
  require_cavity(study, model);
  require_takes_work(study, model, options);
  require_finer_mesh(study, options);
  FitRecord record = head_of(study, measurement);
  record.unknowns = model.dofs();

  EstimatedParameters estimated = estimated_parameters(study, model);
  if (options.start) take_start(estimated, *options.start, study.file.string());
  const std::unique_ptr<ElasticMotion> body =
      study_motion(study, std::move(model), estimated.groups, options.unload);
  ElasticMotion& motion = *body;
  motion.consider(considered_by(study, motion.model(), options));
  const FitOutcome fit =
      fit_from_current_values(motion, estimated, measurement,
                              fit_options_of(study, options, estimated, motion, record), record.remarks);

  record_search(record, fit, estimated);
  record_undeformed(record, measurement);
  if (measurement.repeated_rows > 0)
    record.excluded.push_back({"rows that repeat another to the last digit", measurement.repeated_rows});
  if (fit.values.empty()) return record;
  record.chi2 = fit.chi2;
  record.dof = static_cast<size_t>(std::max(0.0, std::round(static_cast<double>(fit.rows) - fit.unknowns)));
  record.chi2_per_dof = record.chi2 / static_cast<double>(record.dof);
  record_parameters(record, estimated, fit);
  record_frames(record, fit);
  if (auto* unloaded = dynamic_cast<UnloadedMotion*>(body.get())) record_unloading(record, *unloaded, fit);
  if (const auto& work = options.work)
    record.energy = FittedEnergy{work->frame, work->work_mJ, work->sigma_mJ, fit.stored_energy_mJ.value()};
  record.residuals = histogram_of(fit);
  remark_on_mesh(record, study, options, fit, motion.model());
  for (std::string& remark : remarks_on(record, fit))
    record.remarks.push_back(std::move(remark));
  const EstimatedFrame& most_loaded = *std::ranges::max_element(
      fit.frames, {}, [](const EstimatedFrame& frame) { return std::abs(frame.pressure_kPa); });
  record.section_frame = most_loaded.number;
  if (std::holds_alternative<AnnulusSpecimen>(study.specimen))
    record.sections = draw_sections(motion.mesh(), most_loaded, measurement);
  return record;
}

}  // namespace diastole
