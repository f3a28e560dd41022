#pragma once
// What `diastole explain` found: where model and data disagree, the missing effects, what remains open, and what the
// report draws. Written as JSON (docs/explain.md); nothing here is computed.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/inference/termination.hpp"

namespace diastole::explain {

/// named: exactly one set of effects survives. ambiguous: these data cannot distinguish several sets. unexplained: the
/// misfit has structure that no known effect removes; `effects` is then empty, but for what the images of the same study name. none: nothing exceeds the model's own error.
enum class Verdict { named, ambiguous, unexplained, none };
std::string_view name_of(Verdict verdict);
/// Throws std::invalid_argument for any other word.
Verdict verdict_named(std::string_view word);

struct FoundParameter {
  std::string name;  ///< with its unit: "wave_speed_m_s"
  double value = 0.0;
  double standard_error = 0.0;
  std::array<double, 2> ci90{};  ///< of the profile or, where it is symmetric, 1.645 standard errors
  std::string unit = {};         ///< for people: "m/s"; empty of a pure number
};

/// When an effect began: the run and the second at which steps were lost or a sensor stepped.
struct FoundChangePoint {
  std::string run;
  double time_s = 0.0;
};

struct FoundEffect {
  std::string id;
  std::vector<FoundParameter> parameters;
  std::vector<FoundChangePoint> change_points;
  /// RMS of what it changes over that of the model's own error.
  std::optional<double> size_over_model_error = {};
};

/// An effect that is significant and smaller than the model's own error.
struct Hint {
  std::string id;
  double size_over_model_error = 0.0;
  double probability = 0.0;
};

/// A part of the model's error: "cavity", "cavity_transient" (what sets in or drifts), "pump", "pump_transient", "volume";
/// and "tolerances": the part of the rig that the fit takes to be furthest from what it may be.
struct ErrorPart {
  std::string part;
  double beyond_expected_sd = 0.0;  ///< how much larger than expected, in sds of what is known of it
};

/// A part of the rig or the specimen that the fit takes to be other than declared, within what such parts may be.
struct Departure {
  std::string part;     ///< "hose_wave_speed"
  double offset = 0.0;  ///< from what is declared
  std::string unit;     ///< "ln": of the logarithm of a factor
  double sds = 0.0;     ///< over the sd of such parts
};

/// How much more equal cycles differ from each other than by the noise and a common factor: what no model of repeated
/// motion explains.
struct CycleScatter {
  std::string channel;  ///< "cavity_kPa"
  double rms_Pa = 0.0;
  double noise_Pa = 0.0;  ///< in the same band
  double percent_of_range = 0.0;
};

/// What the model gets wrong by itself, in the cavity's pressure.
struct ModelErrorSize {
  std::string source;  ///< "reference", "estimated" from how the waveforms predict each other, "stated"
  double rms_Pa = 0.0;
  double percent_of_range = 0.0;
  std::vector<ErrorPart> parts = {};
};

/// What the rig's references leave by themselves, fitted with their own tolerances.
struct ReferenceMisfit {
  std::string channel;  ///< "cavity_kPa"
  double rms = 0.0;     ///< Pa; mL of volumes
  double percent_of_range = 0.0;
};
struct ReferenceSummary {
  size_t sessions = 0;
  std::vector<ReferenceMisfit> channels;
  std::vector<Departure> departures;  ///< of one sd and more, the largest first
};

/// A place in the data where the base model fails beyond noise and its own error, after correction for how many were looked at.
struct Misfit {
  std::string port;     ///< "drive", "specimen", "sensor", "clock", "field"
  std::string run;      ///< empty for tags
  std::string channel;  ///< "cavity_kPa", "pump_kPa", "cavity_mL", "tags"
  std::optional<int> segment;
  std::optional<std::array<double, 2>> phase;    ///< of the cycle
  std::optional<std::array<double, 2>> band_Hz;  ///< if one stands out
  std::string region;                            ///< "" or in words: "around 60 deg, z 12 mm, inner third"
  double excess_chi2 = 0.0;                      ///< above what noise gives
  double p_value = 1.0;
};

/// Reduced chi-squares on data that were not used for the fit. closed = 1 - (after - floor) / (before - floor).
struct Gap {
  double before = 1.0;
  double after = 1.0;
  double floor = 1.0;
  double closed = 0.0;
  std::vector<std::string> held_out;
};

/// One row of the evidence table.
struct Candidate {
  std::vector<std::string> ids;
  /// Of a rig's twice the gain of ln probability, prior included; linearised if it was not refitted.
  double chi_square_drop = 0.0;
  bool refitted = false;
  size_t parameters = 0;
  /// Of a rig's twice the gain of ln likelihood on waveforms that were not fitted.
  std::optional<double> held_out_drop;
  std::string verdict;  ///< in words: "named", "as good", "refuted: ...", "not needed"
};

struct ParameterShift {
  std::string name;  ///< "C1_kPa"
  double before = 0.0;
  double before_error = 0.0;
  double after = 0.0;
  double after_error = 0.0;
};

/// A channel of a run as measured and as the two models see it; all of one length.
struct Trace {
  std::string run;
  std::string channel;
  std::string unit;
  double noise_sd = 0.0;
  std::vector<double> time_s;
  std::vector<double> measured;  ///< NaN where a gap is declared
  std::vector<double> before;
  std::vector<double> after;
  std::vector<double> cavity_mL;  ///< volume by the augmented model, for p-V loops; may be empty
  std::vector<double> trigger_s;  ///< starts of the run's cycles
};

/// A tag or point in the undeformed body with its residual before and after, in sigmas.
struct FieldResidual {
  std::array<double, 3> place_mm{};
  int frame = 0;
  double before = 0.0;
  double after = 0.0;
  /// Of the residual by a motion that the model lacks there and that grows with the pressure, at the highest one.
  std::array<double, 3> per_mm{};
};

/// What the gap was after each effect, in the order in which they were added; the first is the base model.
struct Step {
  std::string added;
  double reduced_chi_square = 0.0;
};

/// How the search of a fit that the verdict rests on ended.
struct SearchEnd {
  std::vector<std::string> effects;  ///< none: the base model's
  inference::Termination termination = inference::Termination::no_solution;
  bool of_reference = false;  ///< not of this study's recordings
};
/// Whether all of them did so where they were to end.
bool is_settled(const std::vector<SearchEnd>& searches);

/// A law at another port that predicts as well as the learned one.
struct LearnedRival {
  std::string port;
  std::string sets;
  std::vector<std::string> variables;
  std::string effect_file;  ///< beside the JSON
  std::string toml;         ///< the file's text; not in the JSON
};

/// A law that the library lacks, learnt at one port: a suggestion for a person to read and to name, no verdict.
struct LearnedTerm {
  std::string port;                    ///< "drive"
  std::string sets;                    ///< what the law makes, as in an effect file: "p_pump"
  std::vector<std::string> variables;  ///< of the law, the curve's first
  std::string variable_unit;
  std::string unit;                          ///< of the curve
  std::vector<std::array<double, 2>> curve;  ///< variable, value
  std::vector<std::array<double, 2>> band;   ///< 90 % of it at each point
  std::string closed_form;  ///< the simplest formula inside the band, with values; empty: none of those tried
  Gap gap;                  ///< without it and with it, on waveforms that were not fitted
  double held_out_gain = 0.0;          ///< ln of the mean likelihood ratio there
  std::vector<std::string> readings;   ///< what it looks like, in words: suggestions
  std::vector<ParameterShift> shifts;  ///< C1 and offsets without it and with it
  std::vector<LearnedRival> rivals;    ///< that these waveforms cannot distinguish from it
  std::string effect_file;             ///< beside the JSON
  std::string toml;                    ///< the file's text
};

struct NextExperiment {
  std::string toml;  ///< an experiment file, as `diastole run` takes it
  std::vector<std::string> separates;
  double predicted_separation_sigma = 0.0;
  std::string reason;  ///< one sentence for people
};

struct Explanation {
  std::string study;  ///< file
  Verdict verdict = Verdict::none;
  /// That the verdict is right; of an unexplained one, that the best set is wrong (estimator/explain/rig/set_verdict.hpp). Of runs.
  std::optional<double> confidence;
  std::optional<ModelErrorSize> model_error;
  std::optional<ReferenceSummary> reference;
  std::vector<Departure> departures;        ///< of one sd and more, the largest first
  std::vector<CycleScatter> cycle_scatter;  ///< of each sensor
  std::vector<Hint> hints;
  std::vector<FoundEffect> effects;
  std::vector<std::vector<std::string>> ambiguous_with;
  std::vector<Misfit> where;
  Gap gap;
  std::optional<LearnedTerm> learned;
  std::string not_learned;  ///< why no law is proposed where one was looked for
  std::optional<NextExperiment> next_experiment;
  std::string study_after;  ///< file name beside the JSON; empty if nothing was added
  std::string summary;      ///< a few sentences for people
  bool converged = true;    ///< all of `searches`: without, nothing is named
  std::vector<SearchEnd> searches;

  std::vector<Candidate> evidence;
  std::vector<ParameterShift> shifts;
  std::vector<Step> steps;
  std::vector<Trace> traces;
  std::vector<FieldResidual> field;
  std::vector<ParameterShift> law;  ///< of images: the law's values, by the fit that the verdict rests on
  double seconds = 0.0;
};

}  // namespace diastole::explain
