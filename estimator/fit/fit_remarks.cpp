#include "estimator/fit/fit_remarks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/fit/identifiability.hpp"

namespace diastole {
namespace {

constexpr double telling_offset =
    3.5;  // standard deviations: one of two thousand sound measurements is suspected
constexpr double telling_deviation = 4.0;  // standard deviations of chi2/dof that chance does not explain

/// How far chi2/dof is from 1, in its own standard deviations sqrt(2/dof).
double deviation(double chi2_per_dof, double dof) { return (chi2_per_dof - 1) / std::sqrt(2 / dof); }

std::string remark_on_misfit(const FitRecord& record) {
  const double off = deviation(record.chi2_per_dof, static_cast<double>(record.dof));
  const std::string figure =
      fmt::format("chi2/dof = {:.3f}, {:.1f} standard deviations from 1", record.chi2_per_dof, off);
  if (off > telling_deviation) {
    return fmt::format(
        "The residuals are larger than the stated noise ({}): the model lacks something, or sigma_mm is "
        "stated too small. The interval holds only if neither matters.",
        figure);
  }
  if (off < -telling_deviation) {
    return fmt::format(
        "The residuals are smaller than the stated noise ({}): sigma_mm is stated too large, or the points' "
        "errors are not independent.",
        figure);
  }
  return fmt::format("The residuals spread as the stated noise says ({}).", figure);
}

/// Under a robust loss: wild residuals would dominate chi2/dof, so that only the others' core can tell.
std::string remark_on_core(const FitOutcome& fit) {
  constexpr double telling_factor = 1.2;
  std::vector<double> all;
  for (const EstimatedFrame& frame : fit.frames)
    all.insert(all.end(), frame.weighted.begin(), frame.weighted.end());
  const double core =
      core_deviation(Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size())));
  const std::string figure = fmt::format("their core spreads {:.2f} times as far as stated", core);
  if (core > telling_factor) {
    return fmt::format(
        "Even the residuals that are not wild are larger than the stated noise ({}): the model lacks "
        "something, or "
        "sigma_mm is stated too small.",
        figure);
  }
  if (core < 1 / telling_factor)
    return fmt::format("The residuals are smaller than the stated noise ({}).", figure);
  return fmt::format("Apart from the wild ones, the residuals spread as the stated noise says ({}).", figure);
}

void add_pressure_share(std::vector<std::string>& remarks, const FitRecord& record, const FitOutcome& fit) {
  if (record.parameters.size() != 1 || !record.parameters[0].elements.empty()) return;
  const EstimatedValue& value = fit.values[0];
  if (!(value.se > 0)) return;
  const double share = 1 - std::pow(value.se_exact_pressure / value.se, 2);
  remarks.push_back(
      fmt::format("{:.0f} % of the variance of {} comes from the error of the measured pressures; with exact "
                  "pressures its standard error would be {:.3g}.",
                  100 * share, record.parameters[0].name, value.se_exact_pressure));
}

void add_bounds(std::vector<std::string>& remarks, const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters) {
    if (parameter.at_bound.empty()) continue;
    remarks.push_back(
        fmt::format("{} sits on its {} bound{}: the data ask for a value beyond it, and no error can be "
                    "given there. Widen the bounds [{}, {}] or question the model.",
                    parameter.name, parameter.at_bound, parameter.elements.empty() ? "" : " in some elements",
                    parameter.bounds[0], parameter.bounds[1]));
  }
}

void add_conditional_mean(std::vector<std::string>& remarks, const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters) {
    const auto held = std::count_if(parameter.elements.begin(), parameter.elements.end(),
                                    [](const FittedElement& element) { return std::isnan(element.se); });
    if (held == 0) continue;
    remarks.push_back(fmt::format(
        "The mean {} and its interval are conditional on the bound: {} of {} elements rest on it and "
        "count as exactly known there, so that the interval is narrower than the data's own.",
        parameter.name, held, parameter.elements.size()));
  }
}

std::string smoothing_words(const FittedParameter& parameter) {
  if (!parameter.smoothness) return "without any smoothing";
  const FittedSmoothness& smoothness = *parameter.smoothness;
  const std::string counts = fmt::format("the data determine {:.1f} of its {} values by themselves",
                                         smoothness.effective_values, parameter.elements.size());
  if (!smoothness.by_evidence) {
    return fmt::format("neighbours being held alike within {:.2g} %, as you asked ({})",
                       100 * smoothness.step, counts);
  }
  if (smoothness.none_seen) {
    return fmt::format(
        "but the data show no difference between elements (neighbours alike within {:.2g} % with "
        "95 % probability)",
        100 * smoothness.step90[1]);
  }
  return fmt::format(
      "neighbours differing by {:.2g} % as the data themselves say ({:.2g} to {:.2g} % with 90 % "
      "probability; {})",
      100 * smoothness.step, 100 * smoothness.step90[0], 100 * smoothness.step90[1], counts);
}

void add_regional(std::vector<std::string>& remarks, const FitRecord& record) {
  for (const FittedParameter& parameter : record.parameters) {
    if (parameter.elements.empty()) continue;
    double relative = 0;
    size_t count = 0;
    for (const FittedElement& element : parameter.elements) {
      if (!std::isfinite(element.se)) continue;
      relative += element.se / element.value;
      ++count;
    }
    if (count == 0) continue;
    remarks.push_back(
        fmt::format("{} varies by element, {}: each value has a standard error of {:.2g} % on "
                    "average, their mean one of {:.2g} %.",
                    parameter.name, smoothing_words(parameter), 100 * relative / static_cast<double>(count),
                    100 * parameter.se / parameter.value));
  }
}

void add_posterior(std::vector<std::string>& remarks, const FitRecord& record) {
  constexpr double agreed = 1.05, enough = 100;
  double worst = 1, fewest = record.posterior->draws;
  for (const FittedParameter& parameter : record.parameters) {
    if (!parameter.posterior) continue;
    worst = std::max(worst, parameter.posterior->r_hat);
    fewest = std::min(fewest, parameter.posterior->effective_draws);
  }
  remarks.push_back(fmt::format(
      "Posterior: {} draws from the likelihood itself, equilibria of all frames solved for each ({} "
      "equilibria, {:.0f} "
      "s), {:.0f} % of the steps accepted, R-hat at most {:.3f}, worth at least {:.0f} independent draws.{}",
      record.posterior->draws, record.posterior->equilibria, record.posterior->seconds,
      100 * record.posterior->accepted, worst, fewest,
      worst > agreed || fewest < enough
          ? " That is too few to trust its tails: ask for more with --posterior."
          : ""));
}

/// "C1_kPa 8.9 instead of 9.8", regional values by their mean.
std::string values_with_offset(const FitRecord& record, const OffsetScore& offset) {
  std::string words;
  size_t first = 0;
  for (const FittedParameter& parameter : record.parameters) {
    const size_t count = std::max<size_t>(1, parameter.elements.size());
    double sum = 0;
    for (size_t i = first; i < first + count; ++i)
      sum += offset.values[i];
    words += fmt::format("{}{} {:.4g} instead of {:.4g}", words.empty() ? "" : ", ", parameter.name,
                         sum / static_cast<double>(count), parameter.value);
    first += count;
  }
  return words;
}

void add_offset(std::vector<std::string>& remarks, const FitRecord& record, const FitOutcome& fit) {
  if (!fit.converged() || !fit.offset_score) return;
  const OffsetScore& offset = *fit.offset_score;
  const double deviations = std::abs(offset.value_kPa) / offset.se_kPa;
  if (!(deviations > telling_offset)) return;
  remarks.push_back(
      fmt::format("The pressures seem to read {:.3g} ± {:.2g} kPa too {} ({:.1f} standard deviations): with "
                  "that the frames "
                  "agree better, and the values would be about {}. Check the catheter's zero; "
                  "--pressure-offset {:.2g} seeks "
                  "the offset, and the errors then hold it.",
                  std::abs(offset.value_kPa), offset.se_kPa, offset.value_kPa > 0 ? "high" : "low",
                  deviations, values_with_offset(record, offset), 2 * std::abs(offset.value_kPa)));
}

void add_undeformed(std::vector<std::string>& remarks, const FitRecord& record) {
  if (record.undeformed.points == 0) return;
  const double off =
      deviation(record.undeformed.chi2_per_residual, static_cast<double>(record.undeformed.residuals));
  if (off > telling_deviation) {
    remarks.push_back(fmt::format(
        "Frame 0 contradicts the data's own frame of reference: its {} points miss their undeformed "
        "places by more than the noise (chi2/residual = {:.2f}, mean {:+.3f} mm). Check plane_mm, "
        "the axes, and that frame 0 is unloaded.",
        record.undeformed.points, record.undeformed.chi2_per_residual, record.undeformed.mean_mm));
  } else {
    remarks.push_back(fmt::format(
        "Frame 0, which is not fitted, confirms the noise: its {} points miss their undeformed places "
        "with chi2/residual = {:.2f} and a mean of {:+.3f} mm.",
        record.undeformed.points, record.undeformed.chi2_per_residual, record.undeformed.mean_mm));
  }
}

}  // namespace

std::vector<std::string> remarks_on(const FitRecord& record, const FitOutcome& fit) {
  std::vector<std::string> remarks = {fit.robust ? remark_on_core(fit) : remark_on_misfit(record)};
  add_pressure_share(remarks, record, fit);
  add_bounds(remarks, record);
  add_conditional_mean(remarks, record);
  add_regional(remarks, record);
  add_offset(remarks, record, fit);
  add_undeformed(remarks, record);
  for (std::string& remark : identifiability_remarks(record))
    remarks.push_back(std::move(remark));
  if (record.posterior) add_posterior(remarks, record);
  if (!fit.interrupted.empty())
    remarks.push_back(fmt::format("The {} was ended on request; the fit itself is whole.", fit.interrupted));
  if (record.search == "finite differences") {
    remarks.push_back(
        "Searched as the paper did: sums of squares in mm, pressures taken as exact, derivatives by finite "
        "differences, "
        "tolerance 0.001. Errors are those of this estimate at exact pressures.");
  }
  if (record.robust) {
    remarks.push_back(
        fmt::format("Fitted with Student's t instead of the normal distribution, because of {} wild "
                    "residuals: they hardly count, "
                    "and errors come from the residuals' own spread. Look for mistracked points.",
                    record.robust->wild));
  } else if (record.outliers_5sigma > 0) {
    remarks.push_back(fmt::format(
        "{} residuals are beyond 5 standard deviations; chance makes one in two million. Look for "
        "mistracked points.",
        record.outliers_5sigma));
  }
  return remarks;
}

}  // namespace diastole
