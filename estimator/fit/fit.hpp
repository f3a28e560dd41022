#pragma once
// The fit: material values that make the model's motion agree best with the measured one.
//
//   FitOutcome fit = fit_motion(model, {{6, 1, 15, "C1_kPa", "kPa"}}, measurement, {});
//   fit.values[0].value, fit.values[0].se, fit.values[0].ci95
//
// The estimate is the maximum of the likelihood of tag points, 3-D points and frame pressures under their
// stated normal errors (joint_problem.hpp). Standard errors are those of the joint problem, (JᵀJ)⁻¹, so that
// they carry the pressures' errors; they trust the stated sigmas and are not rescaled by chi2/dof. With tracked tags
// they are those of residuals that err alike within patches: sixteenths of a view, a quarter of its planes by a quarter of their length, where these are larger (Liang and Zeger 1986).
// A robust fit's errors are those of an M-estimator: they come from the residuals' own spread. The 95 %
// interval is symmetric in the coordinate of the value: for a positive one a factor up and down. Smooth regional
// values have the posterior's standard deviation instead: data and smoothness together, the smoothness' own
// uncertainty included, and are the posterior's means over that uncertainty: a map that the most probable smoothness
// would flatten keeps what the data may have seen. Their intervals are the posterior's central 95 %.

#include <Eigen/Dense>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "estimator/fit/joint_problem.hpp"
#include "estimator/fit/offset_score.hpp"
#include "estimator/fit/posterior.hpp"
#include "estimator/inference/least_squares.hpp"
#include "estimator/io/fit_file.hpp"

namespace diastole {

/// A parameter that varies by element: its values are smooth from element to element (smoothness.hpp).
struct SmoothRegion {
  size_t first_value;          ///< of as many as the mesh has elements
  std::optional<double> step;  ///< how strongly; default: by evidence
};

enum class Robustness {
  if_needed,  ///< Student's t once more points are wild than chance explains
  always,
  never
};

struct FitOptions {
  std::string file;                 ///< named in errors
  inference::SearchOptions search;  ///< its on_step is not used
  /// Searches follow one another as long as where one ended other points lie on the body, or another smoothness (than in
  /// any search before) or loss fits: one to three as a rule. So many at most.
  int most_searches = 8;
  LocatorOptions locator;  ///< how far outside the body a point may lie
  std::vector<SmoothRegion> smooth;
  Robustness robustness = Robustness::if_needed;
  /// All frame pressures may be off by one and the same unknown amount, 0 with this standard deviation.
  std::optional<double> pressure_offset_sigma_kPa;
  /// One more residual (work_energy.hpp). Precondition: the motion has an energy.
  std::optional<MeasuredWork> work;
  /// What the model's mesh gets wrong at the estimate (finer_mesh.hpp), which then is sought again with it; nothing where it is not found.
  std::function<std::optional<Eigen::VectorXd>(const JointProblem& problem, const Eigen::VectorXd& q)>
      correction = {};
  std::vector<size_t> profiled;  ///< values whose profile interval is wanted (profile.hpp)
  std::optional<PosteriorOptions> posterior;
  /// Called at each iteration with values in their own units.
  std::function<void(const inference::SearchStep&)> on_step;
};

/// Where the variance of an estimate comes from; they add up to 1. What smoothness and residuals that are alike add is shared by
/// images and pressures as their variance is without it.
using VarianceShares = FittedVarianceShares;

struct EstimatedValue {
  double value;
  double se;                   ///< NaN on a bound
  std::array<double, 2> ci95;  ///< NaN on a bound
  double se_exact_pressure;    ///< what `se` would be if the frame pressures were exactly known
  bool at_lower;
  bool at_upper;
  std::optional<VarianceShares> shares = {};  ///< none on a bound
};

/// What everything but its reading says of a frame's pressure, and how far the reading is from that: the deleted residual
/// (Cook and Weisberg, Residuals and Influence in Regression, 1982, 2.2.1). In terms of what the sensor would read, an offset
/// included; the error holds how the residuals spread, and neither --fibre-sigma-deg nor --geometry-sigma-mm.
struct PressureByMotion {
  double value_kPa;
  double se_kPa;
  double reading_off;  ///< reading less value, in standard deviations of the two together
};

struct EstimatedFrame {
  int number;
  Frame load;
  double pressure_kPa;
  double se_kPa;  ///< 0 when exactly known
  std::optional<PressureByMotion>
      by_motion;  ///< absent where the pressure is exactly known, or known from the reading alone
  FoundPoints found;
  Eigen::VectorXd weighted;  ///< residuals / sigma
  Eigen::VectorXd unweighted_mm;
  NodeField position_mm;  ///< the fitted motion
};

/// `step90` is the step twice if it was given; with evidence `effective_values` is its mean.
struct SmoothOutcome : FittedSmoothness {
  size_t first_value;
};

struct RobustOutcome {
  RobustLoss loss;
  Eigen::Index wild;  ///< residuals beyond five standard deviations of the core
};

struct EstimatedPressure {
  double value_kPa;
  double se_kPa;  ///< 0 when exactly known, up to an offset
};

struct PressureOffset {
  double value_kPa;  ///< measured less true
  double se_kPa;
};

struct ProfileInterval : FittedProfile {
  size_t place;  ///< of the value
  bool found;
};

struct PosteriorOutcome : PosteriorDrawing {
  std::vector<FittedPosterior> values;
};

struct FitOutcome {
  std::vector<EstimatedValue> values;
  std::vector<EstimatedFrame> frames;
  Eigen::MatrixXd covariance;              ///< of all unknowns of joint_problem.hpp, in their own units
  std::vector<std::string> unknown_names;  ///< in its order
  std::vector<std::string> undetermined;   ///< combinations of unknowns that move no residual, in words
  std::optional<PressureOffset> pressure_offset;
  /// At which the shape was imaged, if it was under load.
  std::optional<EstimatedPressure> imaged_pressure;
  std::optional<OffsetScore> offset_score;  ///< without pressure_offset, where the data see one
  std::optional<double> stored_energy_mJ;   ///< since frame 0, at the frame of FitOptions::work
  std::vector<ProfileInterval> profiles;
  std::optional<PosteriorOutcome> posterior;
  double chi2 = 0;        ///< including the pressures' priors
  Eigen::Index rows = 0;  ///< residuals, pressure priors included
  double alike = 1;  ///< by what neighbours' errors being alike widens the largest standard error of a value
  double unknowns = 0;  ///< not counting those on a bound; smooth values as many as the data see
  std::vector<SmoothOutcome> smoothness;
  std::optional<RobustOutcome> robust;  ///< if the loss was not the normal's
  std::optional<double>
      corrected;  ///< RMS of the mesh's correction in the residuals' standard deviations, if there was one
  inference::Termination termination = inference::Termination::no_solution;
  std::string interrupted;  ///< what was ended on request after the search: "profile", "posterior" or neither
  std::string reason;
  int iterations = 0;
  int forward_solves = 0;
  double seconds = 0;
  std::vector<inference::SearchStep> history;  ///< q of each step with values in their own units

  [[nodiscard]] bool converged() const { return inference::is_settled(termination); }
};

/// Never throws for numerical trouble: `termination` and `reason` report it (values then are the best found). Throws
/// InputError when hardly any point lies on the body (usable_points.hpp).
/// Precondition: at least one loaded frame has points.
FitOutcome fit_motion(MotionModel& model, const std::vector<EstimatedParameter>& parameters,
                      const Measurement& measurement, const FitOptions& options);

}  // namespace diastole
