#pragma once
// The result of a fit, as `diastole fit --json` prints it and `-o FIT.json` keeps it
// (format "diastole-fit", format_version 1), and as `diastole report` reads it back.
// Lengths in mm, pressures in kPa, times in s. A number that does not exist (the standard error of a
// parameter that sits on its bound) is NaN here and null in JSON.

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

struct FittedElement {
  double value;
  double se;
  std::array<double, 2> ci95;
};

/// How alike a regional parameter's neighbouring elements were taken to be (estimator/fit/smoothness.hpp).
struct FittedSmoothness {
  double step;                   ///< the usual relative difference between neighbours
  bool by_evidence;              ///< or else given
  bool none_seen;                ///< the evidence asks for no difference between elements
  std::array<double, 2> step90;  ///< 90 % interval of the step
  double effective_values;       ///< how many independent values the data determine
};

/// From the likelihood's true shape (estimator/inference/profile.hpp).
struct FittedProfile {
  std::array<double, 2> ci95;
  std::array<bool, 2> at_bound;        ///< the bound ends the interval, not the data
  std::vector<double> value = {};      ///< where it was tried, rising
  std::vector<double> cost_rise = {};  ///< of each, above the least cost
};

/// From draws of the posterior (estimator/fit/posterior.hpp).
struct FittedPosterior {
  double mean;
  double sd;
  std::array<double, 2> ci95;
  double r_hat;
  double effective_draws;
};

/// How the posterior was drawn.
struct PosteriorDrawing {
  int draws;
  double accepted;
  long equilibria;
  double seconds;
};

/// Where a parameter's variance comes from; the shares add up to 1.
struct FittedVarianceShares {
  double images;     ///< the tags' or points' own errors
  double pressures;  ///< frames', the imaged shape's, and an offset that was sought
  double fibres;     ///< --fibre-sigma-deg
  double geometry;   ///< --geometry-sigma-mm
};

struct FittedParameter {
  std::string name;  ///< with its unit
  double value;      ///< of a regional parameter: the mean over the elements
  double se;
  std::array<double, 2> ci95;
  double start;
  std::array<double, 2> bounds;
  std::string at_bound;                 ///< "", "lower" or "upper"
  std::vector<FittedElement> elements;  ///< empty unless the parameter varies by element
  std::optional<FittedSmoothness> smoothness = {};
  std::optional<FittedProfile> profile = {};                 ///< of a whole parameter, if asked for
  std::optional<FittedPosterior> posterior = {};             ///< the same
  std::optional<FittedVarianceShares> variance_shares = {};  ///< of a whole parameter that has an error
};

struct FittedFrame {
  int frame;
  double time_s;
  double measured_kPa;
  double sigma_kPa;      ///< of the measured pressure
  double estimated_kPa;  ///< from pressure and motion together
  double se_kPa;
  size_t points;
  double rms_mm;
  double chi2_per_point;
};

struct FitIteration {
  int iteration;
  double cost;  ///< half the weighted sum of squares
  bool accepted;
  std::vector<double> parameters;  ///< in the order of `parameters`; regional ones by their mean
};

/// A combination of parameters, one relative change each, in the order of `parameters` (whole, positive ones only).
struct FittedDirection {
  double relative_sd;  ///< how far the data let the combination go, as a standard deviation
  std::vector<std::pair<std::string, double>> change;  ///< by parameter; of length 1, the largest positive
};

/// Of a fit whose loss is not the normal's (estimator/fit/robust_loss.hpp).
struct FittedRobust {
  double degrees;  ///< of Student's t
  double scale;    ///< in stated standard deviations
  size_t wild;     ///< residuals beyond five standard deviations
};

/// A pressure's offset with its standard error.
struct FittedOffset {
  double value;
  double se;
};

/// Of a fit of a shape that was imaged under load: that load, and the shape without it at the estimate.
struct FittedUnloading {
  double imaged_at_kPa;  ///< as measured
  double sigma_kPa;
  double estimated_kPa;
  double se_kPa;              ///< 0 when exactly known
  double cavity_imaged_mL;    ///< NaN where the cavity is open
  double cavity_unloaded_mL;  ///< the same
  double return_mm;  ///< farthest place from the image after inflating the unloaded shape to estimated_kPa
  bool returned;     ///< that pressure was reached, and is stable as far as this is known
};

/// The work-energy equation of a fit that used it (estimator/fit/work_energy.hpp).
struct FittedEnergy {
  int frame;       ///< the most loaded one
  double work_mJ;  ///< of the pressure since frame 0, as measured
  double sigma_mJ;
  double stored_mJ;  ///< in the wall, at the estimate
};

/// How frame 0, which is not fitted, agrees with the undeformed body.
struct UndeformedCheck {
  size_t points;
  size_t residuals;
  double chi2_per_residual;  ///< NaN without such points
  double mean_mm;
};

/// Points that could not be used, and why.
struct Exclusion {
  std::string reason;
  size_t points;
};

struct Correlation {
  std::vector<std::string> names;
  std::vector<std::vector<double>> matrix;
};

/// Residuals divided by their standard deviations, counted between edges; the outermost bins hold the rest.
struct ResidualHistogram {
  std::vector<double> edges;
  std::vector<double> counts;
};

/// A curve or a set of points in a drawing's plane: horizontal and vertical coordinates, equally long.
struct PlaneCurve {
  std::vector<double> h_mm;
  std::vector<double> v_mm;
};

/// A plane cut through the specimen before and after deformation.
struct FitSection {
  std::string title;
  std::string horizontal;  ///< axis label with unit
  std::string vertical;
  std::vector<PlaneCurve> outline_before;
  std::vector<PlaneCurve> outline_after;
  std::vector<PlaneCurve> lines_before;  ///< tag planes (tags) or material grid (points)
  std::vector<PlaneCurve> lines_after;   ///< the same, carried along by the fitted model
  PlaneCurve observed;                   ///< measured points near the plane
};

struct FitRecord {
  std::string study;
  std::string law;
  std::string specimen;  ///< kind
  std::vector<int> mesh;
  size_t unknowns;
  std::string data;  ///< "tags", "points" or "tags and points"
  std::vector<FittedParameter> parameters;
  Correlation correlation;
  std::vector<FittedDirection> directions =
      {};  ///< from the one that the data see worst; empty for one parameter
  std::optional<FittedRobust> robust = {};
  std::optional<PosteriorDrawing> posterior = {};
  /// Of all frame pressures, measured less true; if it was sought.
  std::optional<FittedOffset> pressure_offset_kPa = {};
  std::optional<FittedUnloading> unloaded = {};
  std::optional<FittedEnergy> energy = {};
  double rms_mm;  ///< of the unweighted residuals (a tag's along its normal; a point's three components)
  double chi2;
  size_t dof;
  double chi2_per_dof;
  bool converged;
  std::string reason;
  int iterations;
  int forward_solves;
  double seconds;
  std::vector<FitIteration> history;
  size_t residuals_used;
  std::vector<Exclusion> excluded;
  size_t outliers_5sigma;
  UndeformedCheck undeformed;
  std::vector<FittedFrame> frames;
  ResidualHistogram residuals;
  int section_frame;
  std::vector<FitSection> sections;
  std::vector<std::string> remarks;  ///< whole sentences for the reader
  std::vector<Finding> findings;     ///< what is wrong with the data, the gravest first
  std::string fingerprint = {};      ///< of the study and its data (study_fingerprint.hpp)
  std::optional<std::string> images =
      {};  ///< file of what was tracked for it (tracking_file.hpp), if the data are images
};

/// Near the start of each such document.
inline constexpr std::string_view fit_file_mark = "\"format\": \"diastole-fit\"";

/// One JSON document, indented, ending in a line feed.
std::string to_json(const FitRecord& record);

/// Throws InputError if the text is not such a document; `file` stands for it in messages.
FitRecord fit_record_from_json(std::string_view text, const std::string& file);

/// Writes a file that is complete or absent (temporary name, then rename). Throws InputError if it cannot.
void write_fit_file(const FitRecord& record, const std::filesystem::path& path);

}  // namespace diastole
