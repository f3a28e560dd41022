#include "estimator/io/fit_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "estimator/io/finding_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* format_name = "diastole-fit";
constexpr int newest_version = 1;

// JSON has no NaN: it is written as null, and null is read as NaN.
Json from_number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }
double to_number(const Json& json) {
  return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}
Json from_interval(const std::array<double, 2>& interval) {
  return Json::array({from_number(interval[0]), from_number(interval[1])});
}
std::array<double, 2> to_interval(const Json& json) { return {to_number(json.at(0)), to_number(json.at(1))}; }

/// Drawings need a hundredth of a millimetre, not seventeen digits.
Json from_lengths(const std::vector<double>& values_mm) {
  Json json = Json::array();
  for (const double value : values_mm)
    json.push_back(from_number(std::round(value * 100) / 100));
  return json;
}
std::vector<double> to_numbers(const Json& json) {
  std::vector<double> values;
  for (const Json& value : json)
    values.push_back(to_number(value));
  return values;
}

Json from_curve(const PlaneCurve& curve) {
  return {{"h_mm", from_lengths(curve.h_mm)}, {"v_mm", from_lengths(curve.v_mm)}};
}
PlaneCurve to_curve(const Json& json) {
  PlaneCurve curve{to_numbers(json.at("h_mm")), to_numbers(json.at("v_mm"))};
  if (curve.h_mm.size() != curve.v_mm.size()) throw std::invalid_argument("h_mm and v_mm differ in length");
  return curve;
}
Json from_curves(const std::vector<PlaneCurve>& curves) {
  Json json = Json::array();
  for (const PlaneCurve& curve : curves)
    json.push_back(from_curve(curve));
  return json;
}
std::vector<PlaneCurve> to_curves(const Json& json) {
  std::vector<PlaneCurve> curves;
  for (const Json& curve : json)
    curves.push_back(to_curve(curve));
  return curves;
}

Json from_parameter(const FittedParameter& parameter) {
  Json json = {{"value", from_number(parameter.value)},     {"se", from_number(parameter.se)},
               {"ci95", from_interval(parameter.ci95)},     {"start", from_number(parameter.start)},
               {"bounds", from_interval(parameter.bounds)}, {"at_bound", parameter.at_bound}};
  if (!parameter.elements.empty()) {
    Json elements = Json::array();
    for (const FittedElement& element : parameter.elements) {
      elements.push_back({{"value", from_number(element.value)},
                          {"se", from_number(element.se)},
                          {"ci95", from_interval(element.ci95)}});
    }
    json["elements"] = std::move(elements);
  }
  if (const auto& smoothness = parameter.smoothness) {
    json["smoothness"] = {{"step", smoothness->step},
                          {"by_evidence", smoothness->by_evidence},
                          {"none_seen", smoothness->none_seen},
                          {"step90", from_interval(smoothness->step90)},
                          {"effective_values", from_number(smoothness->effective_values)}};
  }
  if (const auto& profile = parameter.profile)
    json["profile"] = {{"ci95", from_interval(profile->ci95)},
                       {"at_bound", profile->at_bound},
                       {"value", profile->value},
                       {"cost_rise", profile->cost_rise}};
  if (const auto& posterior = parameter.posterior) {
    json["posterior"] = {{"mean", posterior->mean},
                         {"sd", posterior->sd},
                         {"ci95", posterior->ci95},
                         {"r_hat", from_number(posterior->r_hat)},
                         {"effective_draws", from_number(posterior->effective_draws)}};
  }
  return json;
}
FittedParameter to_parameter(const std::string& name, const Json& json) {
  FittedParameter parameter{.name = name,
                            .value = to_number(json.at("value")),
                            .se = to_number(json.at("se")),
                            .ci95 = to_interval(json.at("ci95")),
                            .start = to_number(json.at("start")),
                            .bounds = to_interval(json.at("bounds")),
                            .at_bound = json.at("at_bound"),
                            .elements = {},
                            .smoothness = {}};
  if (json.contains("elements")) {
    for (const Json& element : json.at("elements")) {
      parameter.elements.push_back(
          {to_number(element.at("value")), to_number(element.at("se")), to_interval(element.at("ci95"))});
    }
  }
  if (json.contains("profile")) {
    const Json& told = json.at("profile");
    parameter.profile = FittedProfile{to_interval(told.at("ci95")), told.at("at_bound")};
    if (told.contains("value")) {
      parameter.profile->value = to_numbers(told.at("value"));
      parameter.profile->cost_rise = to_numbers(told.at("cost_rise"));
    }
    if (parameter.profile->value.size() != parameter.profile->cost_rise.size())
      throw std::invalid_argument("the lists of a profile differ in length");
  }
  if (json.contains("posterior")) {
    const Json& told = json.at("posterior");
    parameter.posterior = FittedPosterior{told.at("mean"), told.at("sd"), to_interval(told.at("ci95")),
                                          to_number(told.at("r_hat")), to_number(told.at("effective_draws"))};
  }
  if (json.contains("smoothness")) {
    const Json& told = json.at("smoothness");
    parameter.smoothness =
        FittedSmoothness{told.at("step"), told.at("by_evidence"), told.at("none_seen"),
                         to_interval(told.at("step90")), to_number(told.at("effective_values"))};
  }
  return parameter;
}

Json from_frame(const FittedFrame& frame) {
  return {{"frame", frame.frame},
          {"time_s", frame.time_s},
          {"measured_kPa", frame.measured_kPa},
          {"sigma_kPa", frame.sigma_kPa},
          {"estimated_kPa", from_number(frame.estimated_kPa)},
          {"se_kPa", from_number(frame.se_kPa)},
          {"points", frame.points},
          {"rms_mm", from_number(frame.rms_mm)},
          {"chi2_per_point", from_number(frame.chi2_per_point)}};
}
FittedFrame to_frame(const Json& json) {
  return {.frame = json.at("frame"),
          .time_s = json.at("time_s"),
          .measured_kPa = json.at("measured_kPa"),
          .sigma_kPa = json.at("sigma_kPa"),
          .estimated_kPa = to_number(json.at("estimated_kPa")),
          .se_kPa = to_number(json.at("se_kPa")),
          .points = json.at("points"),
          .rms_mm = to_number(json.at("rms_mm")),
          .chi2_per_point = to_number(json.at("chi2_per_point"))};
}

Json from_section(const FitSection& section) {
  return {{"title", section.title},
          {"horizontal", section.horizontal},
          {"vertical", section.vertical},
          {"outline_before", from_curves(section.outline_before)},
          {"outline_after", from_curves(section.outline_after)},
          {"lines_before", from_curves(section.lines_before)},
          {"lines_after", from_curves(section.lines_after)},
          {"observed", from_curve(section.observed)}};
}
FitSection to_section(const Json& json) {
  return {.title = json.at("title"),
          .horizontal = json.at("horizontal"),
          .vertical = json.at("vertical"),
          .outline_before = to_curves(json.at("outline_before")),
          .outline_after = to_curves(json.at("outline_after")),
          .lines_before = to_curves(json.at("lines_before")),
          .lines_after = to_curves(json.at("lines_after")),
          .observed = to_curve(json.at("observed"))};
}

Json from_history(const std::vector<FitIteration>& history) {
  Json json = Json::array();
  for (const FitIteration& step : history) {
    json.push_back({{"iteration", step.iteration},
                    {"cost", from_number(step.cost)},
                    {"accepted", step.accepted},
                    {"parameters", step.parameters}});
  }
  return json;
}

Json from_record(const FitRecord& record) {
  Json json = {{"format", format_name}, {"format_version", newest_version}};
  json["study"] = record.study;
  json["fingerprint"] = record.fingerprint;
  json["specimen"] = record.specimen;
  json["law"] = record.law;
  json["data"] = record.data;
  json["parameters"] = Json::object();
  for (const FittedParameter& parameter : record.parameters) {
    json["parameters"][parameter.name] = from_parameter(parameter);
  }
  json["rms_mm"] = from_number(record.rms_mm);
  json["chi2"] = from_number(record.chi2);
  json["dof"] = record.dof;
  json["chi2_per_dof"] = from_number(record.chi2_per_dof);
  json["converged"] = record.converged;
  json["reason"] = record.reason;
  json["iterations"] = record.iterations;
  json["forward_solves"] = record.forward_solves;
  json["seconds"] = record.seconds;
  json["remarks"] = record.remarks;
  json["findings"] = Json::array();
  for (const Finding& finding : record.findings)
    json["findings"].push_back(from_finding(finding));
  json["mesh"] = record.mesh;
  json["unknowns"] = record.unknowns;
  json["residuals_used"] = record.residuals_used;
  json["excluded"] = Json::array();
  for (const Exclusion& exclusion : record.excluded) {
    json["excluded"].push_back({{"reason", exclusion.reason}, {"points", exclusion.points}});
  }
  json["outliers_5sigma"] = record.outliers_5sigma;
  json["undeformed"] = {{"points", record.undeformed_points},
                        {"residuals", record.undeformed_residuals},
                        {"chi2_per_residual", from_number(record.undeformed_chi2_per_residual)},
                        {"mean_mm", from_number(record.undeformed_mean_mm)}};
  json["frames"] = Json::array();
  for (const FittedFrame& frame : record.frames)
    json["frames"].push_back(from_frame(frame));
  json["correlation"] = {{"names", record.correlation.names}, {"matrix", record.correlation.matrix}};
  json["directions"] = Json::array();
  for (const FittedDirection& direction : record.directions) {
    Json change = Json::object();
    for (size_t i = 0; i < direction.names.size(); ++i)
      change[direction.names[i]] = direction.change[i];
    json["directions"].push_back({{"relative_sd", from_number(direction.relative_sd)}, {"change", change}});
  }
  if (const auto& robust = record.robust) {
    json["robust"] = {{"degrees", robust->degrees}, {"scale", robust->scale}, {"wild", robust->wild}};
  }
  if (const auto& posterior = record.posterior) {
    json["posterior"] = {{"draws", posterior->draws},
                         {"accepted", posterior->accepted},
                         {"equilibria", posterior->equilibria},
                         {"seconds", posterior->seconds}};
  }
  if (const auto& offset = record.pressure_offset_kPa)
    json["pressure_offset_kPa"] = {{"value", (*offset)[0]}, {"se", from_number((*offset)[1])}};
  json["search"] = record.search;
  json["history"] = from_history(record.history);
  json["residuals"] = {{"edges", record.residuals.edges}, {"counts", record.residuals.counts}};
  json["section_frame"] = record.section_frame;
  json["sections"] = Json::array();
  for (const FitSection& section : record.sections)
    json["sections"].push_back(from_section(section));
  return json;
}

FitRecord to_record(const Json& json) {
  FitRecord record{};
  record.study = json.at("study");
  record.fingerprint = json.value("fingerprint", "");
  record.specimen = json.at("specimen");
  record.law = json.at("law");
  record.data = json.at("data");
  for (const auto& [name, parameter] : json.at("parameters").items()) {
    record.parameters.push_back(to_parameter(name, parameter));
  }
  record.rms_mm = to_number(json.at("rms_mm"));
  record.chi2 = to_number(json.at("chi2"));
  record.dof = json.at("dof");
  record.chi2_per_dof = to_number(json.at("chi2_per_dof"));
  record.converged = json.at("converged");
  record.reason = json.at("reason");
  record.iterations = json.at("iterations");
  record.forward_solves = json.at("forward_solves");
  record.seconds = json.at("seconds");
  record.remarks = json.at("remarks").get<std::vector<std::string>>();
  if (json.contains("findings")) {
    for (const Json& finding : json.at("findings"))
      record.findings.push_back(to_finding(finding));
  }
  record.mesh = json.at("mesh").get<std::vector<int>>();
  record.unknowns = json.at("unknowns");
  record.residuals_used = json.at("residuals_used");
  for (const Json& exclusion : json.at("excluded")) {
    record.excluded.push_back({exclusion.at("reason"), exclusion.at("points")});
  }
  record.outliers_5sigma = json.at("outliers_5sigma");
  record.undeformed_points = json.at("undeformed").at("points");
  record.undeformed_residuals = json.at("undeformed").at("residuals");
  record.undeformed_chi2_per_residual = to_number(json.at("undeformed").at("chi2_per_residual"));
  record.undeformed_mean_mm = to_number(json.at("undeformed").at("mean_mm"));
  for (const Json& frame : json.at("frames"))
    record.frames.push_back(to_frame(frame));
  record.correlation.names = json.at("correlation").at("names").get<std::vector<std::string>>();
  for (const Json& row : json.at("correlation").at("matrix")) {
    record.correlation.matrix.push_back(to_numbers(row));
  }
  if (json.contains("directions")) {
    for (const Json& told : json.at("directions")) {
      FittedDirection direction{to_number(told.at("relative_sd")), {}, {}};
      for (const auto& [name, change] : told.at("change").items()) {
        direction.names.push_back(name);
        direction.change.push_back(change);
      }
      record.directions.push_back(std::move(direction));
    }
  }
  if (json.contains("posterior")) {
    const Json& told = json.at("posterior");
    record.posterior =
        PosteriorDrawing{told.at("draws"), told.at("accepted"), told.at("equilibria"), told.at("seconds")};
  }
  if (json.contains("pressure_offset_kPa")) {
    const Json& offset = json.at("pressure_offset_kPa");
    record.pressure_offset_kPa = {offset.at("value").get<double>(), to_number(offset.at("se"))};
  }
  record.search = json.value("search", record.search);
  if (json.contains("robust")) {
    const Json& robust = json.at("robust");
    record.robust = FittedRobust{robust.at("degrees"), robust.at("scale"), robust.at("wild")};
  }
  for (const Json& step : json.at("history")) {
    record.history.push_back({step.at("iteration"), to_number(step.at("cost")), step.at("accepted"),
                              to_numbers(step.at("parameters"))});
  }
  record.residuals = {to_numbers(json.at("residuals").at("edges")),
                      to_numbers(json.at("residuals").at("counts"))};
  record.section_frame = json.at("section_frame");
  for (const Json& section : json.at("sections"))
    record.sections.push_back(to_section(section));
  return record;
}

}  // namespace

std::string to_json(const FitRecord& record) { return from_record(record).dump(1) + "\n"; }

FitRecord fit_record_from_json(std::string_view text, const std::string& file) {
  const std::string remedy = "Give a file that `diastole fit STUDY -o FIT.json` wrote.";
  try {
    const Json json = Json::parse(text);
    if (!json.is_object() || json.value("format", "") != format_name) {
      throw InputError({file, "key format", fmt::format("is not \"{}\"", format_name), remedy});
    }
    if (json.at("format_version").get<int>() > newest_version) {
      throw InputError({file, "key format_version",
                        fmt::format("version {} is newer than this program knows ({})",
                                    json.at("format_version").get<int>(), newest_version),
                        "Update the program."});
    }
    return to_record(json);
  } catch (const nlohmann::json::exception& error) {
    throw InputError({file, "", fmt::format("is not a fit result: {}", error.what()), remedy});
  } catch (const std::invalid_argument& error) {
    throw InputError({file, "", fmt::format("is not a fit result: {}", error.what()), remedy});
  }
}

void write_fit_file(const FitRecord& record, const std::filesystem::path& path) {
  write_whole_file(path, to_json(record));
}

}  // namespace diastole
