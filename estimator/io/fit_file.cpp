#include "estimator/io/fit_file.hpp"

#include <cmath>

#include "estimator/io/finding_json.hpp"
#include "estimator/io/record_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole {

DIASTOLE_MEMBERS(FittedElement, value, se, ci95)
DIASTOLE_MEMBERS(FittedSmoothness, step, by_evidence, none_seen, step90, effective_values)
DIASTOLE_MEMBERS(FittedPosterior, mean, sd, ci95, r_hat, effective_draws)
DIASTOLE_MEMBERS(PosteriorDrawing, draws, accepted, equilibria, seconds)
DIASTOLE_MEMBERS(FittedFrame, frame, time_s, measured_kPa, sigma_kPa, estimated_kPa, se_kPa, points, rms_mm,
                 chi2_per_point)
DIASTOLE_MEMBERS(FitIteration, iteration, cost, accepted, parameters)
DIASTOLE_MEMBERS(FittedRobust, degrees, scale, wild)
DIASTOLE_MEMBERS(FittedOffset, value, se)
DIASTOLE_MEMBERS(FittedVarianceShares, images, pressures, fibres, geometry)
DIASTOLE_MEMBERS(FittedUnloading, imaged_at_kPa, sigma_kPa, estimated_kPa, se_kPa, cavity_imaged_mL,
                 cavity_unloaded_mL, return_mm, returned)
DIASTOLE_MEMBERS(FittedEnergy, frame, work_mJ, sigma_mJ, stored_mJ)
DIASTOLE_MEMBERS(Exclusion, reason, points)
DIASTOLE_MEMBERS(Correlation, names, matrix)
DIASTOLE_MEMBERS(ResidualHistogram, edges, counts)
DIASTOLE_MEMBERS(UndeformedCheck, points, residuals, chi2_per_residual, mean_mm)
DIASTOLE_MEMBERS(PlaneCurve, h_mm, v_mm)
DIASTOLE_MEMBERS(FitSection, title, horizontal, vertical, outline_before, outline_after, lines_before,
                 lines_after, observed)

template <class Visit, IsRecord<FittedProfile> Record>
void each_member(Visit&& visit, Record& profile) {
  DIASTOLE_VISIT(visit, profile, ci95, at_bound)
  visit("value", may_lack(profile.value));
  visit("cost_rise", may_lack(profile.cost_rise));
}

template <class Visit, IsRecord<FittedParameter> Record>
void each_member(Visit&& visit, Record& parameter) {
  DIASTOLE_VISIT(visit, parameter, value, se, ci95, start, bounds, at_bound)
  visit("elements", if_any(parameter.elements));
  visit("smoothness", if_any(parameter.smoothness));
  visit("profile", if_any(parameter.profile));
  visit("posterior", if_any(parameter.posterior));
  visit("variance_shares", if_any(parameter.variance_shares));
}

template <class Visit, IsRecord<FittedDirection> Record>
void each_member(Visit&& visit, Record& direction) {
  visit("relative_sd", direction.relative_sd);
  visit("change", by_name(direction.change));
}

template <class Visit, IsRecord<FitRecord> Record>
void each_member(Visit&& visit, Record& r) {
  visit("study", r.study);
  visit("fingerprint", may_lack(r.fingerprint));
  DIASTOLE_VISIT(visit, r, specimen, law, data)
  visit("images", if_any(r.images));
  visit("parameters", by_name(r.parameters));
  DIASTOLE_VISIT(visit, r, rms_mm, chi2, dof, chi2_per_dof, converged, reason, iterations, forward_solves,
                 seconds, remarks)
  visit("findings", may_lack(r.findings));
  DIASTOLE_VISIT(visit, r, mesh, unknowns, residuals_used, excluded, outliers_5sigma, undeformed, frames,
                 correlation)
  visit("directions", may_lack(r.directions));
  visit("robust", if_any(r.robust));
  visit("posterior", if_any(r.posterior));
  visit("pressure_offset_kPa", if_any(r.pressure_offset_kPa));
  visit("unloaded", if_any(r.unloaded));
  visit("energy", if_any(r.energy));
  DIASTOLE_VISIT(visit, r, history, residuals, section_frame, sections)
}

namespace {

constexpr RecordFormat fit_format{"diastole-fit", "a fit result",
                                  "Give a file that `diastole fit STUDY -o FIT.json` wrote."};

/// Drawings need a hundredth of a millimetre, not seventeen digits.
double hundredths(double value) { return std::round(value * 100) / 100; }

void require_sound(const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters) {
    if (parameter.profile && parameter.profile->value.size() != parameter.profile->cost_rise.size())
      throw std::invalid_argument("the lists of a profile differ in length");
  }
  const auto require_pairs = [](const PlaneCurve& curve) {
    if (curve.h_mm.size() != curve.v_mm.size()) throw std::invalid_argument("h_mm and v_mm differ in length");
  };
  for (const FitSection& section : record.sections) {
    require_pairs(section.observed);
    for (const auto* curves :
         {&section.outline_before, &section.outline_after, &section.lines_before, &section.lines_after})
      std::ranges::for_each(*curves, require_pairs);
  }
}

}  // namespace

std::string to_json(const FitRecord& record) {
  Json json = fit_format.document(written(record));
  round_numbers(json["sections"], hundredths);
  return json_text(json, 1) + "\n";
}

FitRecord fit_record_from_json(std::string_view text, const std::string& file) {
  FitRecord record{};
  fit_format.read(text, file, [&](const Json& json) {
    read_json(json, record);
    require_sound(record);
  });
  return record;
}

void write_fit_file(const FitRecord& record, const std::filesystem::path& path) {
  write_whole_file(path, to_json(record));
}

}  // namespace diastole
