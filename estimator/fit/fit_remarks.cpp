#include "estimator/fit/fit_remarks.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace diastole {
namespace {

constexpr double significant_offset =
    3.5;  // standard deviations: one of two thousand sound measurements is suspected
constexpr double significant_deviation = 4.0;  // standard deviations of chi2/dof that chance does not explain

constexpr double strong_correlation = 0.8;
constexpr size_t most_pairs = 6;
constexpr double small_share = 0.1;       // of a direction: not worth a word
constexpr double unseen_relative_sd = 1;  // beyond this a value is known by its bounds only
constexpr double unbalanced = 5.0;        // largest over smallest standard deviation worth reporting

/// How far chi2/dof is from 1, in its own standard deviations sqrt(2/dof).
double deviation(double chi2_per_dof, double dof) { return (chi2_per_dof - 1) / std::sqrt(2 / dof); }

std::string remark_on_misfit(const FitRecord& record) {
  const double off = deviation(record.chi2_per_dof, static_cast<double>(record.dof));
  const std::string figure =
      fmt::format("chi2/dof = {:.3f}, {:.1f} standard deviations from 1", record.chi2_per_dof, off);
  if (off > significant_deviation) {
    return fmt::format(
        "The residuals are larger than the stated noise ({}): the model lacks something, or sigma_mm is "
        "stated too small. The interval holds only if neither matters.",
        figure);
  }
  if (off < -significant_deviation) {
    return fmt::format(
        "The residuals are smaller than the stated noise ({}): sigma_mm is stated too large, or the points' "
        "errors are not independent.",
        figure);
  }
  return fmt::format("The residuals spread as the stated noise says ({}).", figure);
}

/// Under a robust loss: wild residuals would dominate chi2/dof, so that only the others' core is compared.
std::string remark_on_core(const FitOutcome& fit) {
  constexpr double notable_factor = 1.2;
  std::vector<double> all;
  for (const EstimatedFrame& frame : fit.frames)
    all.insert(all.end(), frame.weighted.begin(), frame.weighted.end());
  const double core =
      core_deviation(Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size())));
  const std::string figure = fmt::format("their core spreads {:.2f} times as far as stated", core);
  if (core > notable_factor) {
    return fmt::format(
        "Even the residuals that are not wild are larger than the stated noise ({}): the model lacks "
        "something, or sigma_mm is stated too small.",
        figure);
  }
  if (core < 1 / notable_factor)
    return fmt::format("The residuals are smaller than the stated noise ({}).", figure);
  return fmt::format("Apart from the wild ones, the residuals spread as the stated noise says ({}).", figure);
}

void add_alike(std::vector<std::string>& remarks, const FitOutcome& fit) {
  constexpr double notable_factor = 1.2;
  if (fit.alike < notable_factor) return;
  remarks.push_back(
      fmt::format("Residuals of neighbouring tags are alike, as a ghost or a fold in the images makes them: "
                  "standard errors are {:.2g} times those of independent ones.",
                  fit.alike));
}

void add_pressure_share(std::vector<std::string>& remarks, const FitRecord& record, const FitOutcome& fit) {
  if (record.parameters.size() != 1 || !record.parameters[0].elements.empty()) return;
  const EstimatedValue& value = fit.values[0];
  if (!value.shares) return;
  remarks.push_back(
      fmt::format("{:.0f} % of the variance of {} comes from the error of the measured pressures; with exact "
                  "pressures its standard error would be {:.3g}.",
                  100 * value.shares->pressures, record.parameters[0].name, value.se_exact_pressure));
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
    remarks.push_back(
        fmt::format("The mean {} and its interval are conditional on the bound: {} of {} elements rest on it "
                    "and count as exactly known there, so that the interval is narrower than the data's own.",
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
        "but the data show no difference between elements (neighbours alike within {:.2g} % with 95 % "
        "probability)",
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
        fmt::format("{} varies by element, {}: each value has a standard error of {:.2g} % on average, their "
                    "mean one of {:.2g} %.",
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
  remarks.push_back(
      fmt::format("Posterior: {} draws from the likelihood itself, equilibria of all frames solved for each "
                  "({} equilibria, {:.0f} s), {:.0f} % of the steps accepted, R-hat at most {:.3f}, worth at "
                  "least {:.0f} independent draws.{}",
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
  if (!(deviations > significant_offset)) return;
  remarks.push_back(
      fmt::format("The pressures seem to read {:.3g} ± {:.2g} kPa too {} ({:.1f} standard deviations): with "
                  "that the frames agree better, and the values would be about {}. Check the catheter's "
                  "zero; --pressure-offset {:.2g} seeks the offset, and the errors then hold it.",
                  std::abs(offset.value_kPa), offset.se_kPa, offset.value_kPa > 0 ? "high" : "low",
                  deviations, values_with_offset(record, offset), 2 * std::abs(offset.value_kPa)));
}

/// Pressures that the motion contradicts: the furthest of them.
void add_pressures(std::vector<std::string>& remarks, const FitOutcome& fit) {
  if (!fit.converged()) return;
  const auto off = [](const EstimatedFrame& frame) {
    return frame.by_motion ? std::abs(frame.by_motion->reading_off) : 0.0;
  };
  const auto contradicted =
      std::ranges::count_if(fit.frames, [&](const auto& frame) { return off(frame) > significant_offset; });
  if (contradicted == 0) return;
  const EstimatedFrame& worst = *std::ranges::max_element(fit.frames, {}, off);
  remarks.push_back(fmt::format(
      "The motion contradicts the pressure of {}: frame {} was read at {:.4g} kPa and by its "
      "motion was at {:.4g} ± {:.2g} ({:.1f} standard deviations). The interval holds only if "
      "sigma_kPa does: check when the pressures were read, with which zero, and that a finer mesh "
      "gives the same.",
      contradicted == 1 ? "one frame" : fmt::format("{} frames", contradicted), worst.number,
      worst.load.pressure_kPa, worst.by_motion->value_kPa, worst.by_motion->se_kPa, off(worst)));
}

void add_undeformed(std::vector<std::string>& remarks, const FitRecord& record) {
  if (record.undeformed.points == 0) return;
  const double off =
      deviation(record.undeformed.chi2_per_residual, static_cast<double>(record.undeformed.residuals));
  if (off > significant_deviation) {
    remarks.push_back(fmt::format(
        "Frame 0 contradicts the data's own frame of reference: its {} points miss their undeformed places "
        "by more than the noise (chi2/residual = {:.2f}, mean {:+.3f} mm). Check plane_mm, the axes, and "
        "that frame 0 is unloaded.",
        record.undeformed.points, record.undeformed.chi2_per_residual, record.undeformed.mean_mm));
  } else {
    remarks.push_back(fmt::format(
        "Frame 0, which is not fitted, confirms the noise: its {} points miss their undeformed places with "
        "chi2/residual = {:.2f} and a mean of {:+.3f} mm.",
        record.undeformed.points, record.undeformed.chi2_per_residual, record.undeformed.mean_mm));
  }
}

struct Pair {
  std::string one, other;
  double correlation;
};

bool is_whole(const FitRecord& record, const std::string& name) {
  return std::any_of(
      record.parameters.begin(), record.parameters.end(),
      [&](const FittedParameter& parameter) { return parameter.name == name && parameter.elements.empty(); });
}

std::vector<Pair> trading_pairs(const FitRecord& record) {
  const Correlation& correlation = record.correlation;
  std::vector<Pair> pairs;
  for (size_t i = 0; i < correlation.names.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      if (!is_whole(record, correlation.names[i]) || !is_whole(record, correlation.names[j])) continue;
      if (std::abs(correlation.matrix[i][j]) >= strong_correlation)
        pairs.push_back({correlation.names[j], correlation.names[i], correlation.matrix[i][j]});
    }
  }
  std::sort(pairs.begin(), pairs.end(),
            [](const Pair& a, const Pair& b) { return std::abs(a.correlation) > std::abs(b.correlation); });
  if (pairs.size() > most_pairs) pairs.resize(most_pairs);
  return pairs;
}

std::string changes(const FittedDirection& direction) {
  std::vector<std::string> parts;
  for (const auto& [name, change] : direction.change) {
    if (std::abs(change) < small_share) continue;
    parts.push_back(fmt::format("{} {} by {:.2g} %", name, change > 0 ? "up" : "down",
                                100 * direction.relative_sd * std::abs(change)));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

/// Pairs that trade off, the combination that is known worst, the one that is known best.
void add_identifiability(std::vector<std::string>& remarks, const FitRecord& record) {
  for (const Pair& pair : trading_pairs(record)) {
    remarks.push_back(fmt::format(
        "{} and {} trade off: the data tell {} far better than either (correlation {:+.2f}).", pair.one,
        pair.other, pair.correlation > 0 ? "their ratio" : "their product", pair.correlation));
  }
  if (record.directions.size() < 2) return;
  const FittedDirection& worst = record.directions.front();
  const FittedDirection& best = record.directions.back();
  if (worst.relative_sd > unseen_relative_sd) {
    remarks.push_back(
        fmt::format("The data cannot see this combination: {}. Fix one of these parameters, or add loads "
                    "that tell them apart.",
                    changes(worst)));
  } else if (worst.relative_sd > unbalanced * best.relative_sd) {
    remarks.push_back(
        fmt::format("The data see this combination worst (one standard deviation): {}; and this one best: "
                    "{}. The first is {:.0f} times less certain.",
                    changes(worst), changes(best), worst.relative_sd / best.relative_sd));
  }
}

}  // namespace

std::vector<FittedDirection> directions_of(const FitRecord& record, const FitOutcome& fit,
                                           const std::vector<size_t>& first) {
  std::vector<std::string> names;
  std::vector<size_t> place;
  for (size_t i = 0; i < record.parameters.size(); ++i) {
    const FittedParameter& parameter = record.parameters[i];
    if (!parameter.elements.empty() || !(parameter.bounds[0] > 0) || !std::isfinite(parameter.se)) continue;
    names.push_back(parameter.name);
    place.push_back(first[i]);
  }
  const auto count = static_cast<Eigen::Index>(names.size());
  if (count < 2) return {};
  Eigen::MatrixXd relative(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < count; ++j) {
      const size_t a = place[static_cast<size_t>(i)], b = place[static_cast<size_t>(j)];
      relative(i, j) = fit.covariance(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)) /
                       (fit.values[a].value * fit.values[b].value);
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(relative);
  std::vector<FittedDirection> directions;
  for (Eigen::Index k = count; k-- > 0;) {
    Eigen::VectorXd change = solver.eigenvectors().col(k);
    Eigen::Index largest = 0;
    change.cwiseAbs().maxCoeff(&largest);
    if (change[largest] < 0) change = -change;
    FittedDirection direction{std::sqrt(std::max(0.0, solver.eigenvalues()[k])), {}};
    for (Eigen::Index i = 0; i < count; ++i)
      direction.change.emplace_back(names[static_cast<size_t>(i)], change[i]);
    directions.push_back(std::move(direction));
  }
  return directions;
}

std::vector<std::string> remarks_on(const FitRecord& record, const FitOutcome& fit) {
  std::vector<std::string> remarks = {fit.robust ? remark_on_core(fit) : remark_on_misfit(record)};
  add_alike(remarks, fit);
  add_pressure_share(remarks, record, fit);
  add_bounds(remarks, record);
  add_conditional_mean(remarks, record);
  add_regional(remarks, record);
  add_offset(remarks, record, fit);
  add_pressures(remarks, fit);
  add_undeformed(remarks, record);
  add_identifiability(remarks, record);
  for (const std::string& combination : fit.undetermined)
    remarks.push_back(
        fmt::format("Nothing in these data changes along {}: they do not determine it.", combination));
  if (record.posterior) add_posterior(remarks, record);
  if (!fit.interrupted.empty())
    remarks.push_back(fmt::format("The {} was ended on request; the fit itself is whole.", fit.interrupted));
  if (record.robust) {
    remarks.push_back(fmt::format(
        "Fitted with Student's t instead of the normal distribution, because of {} wild residuals: they "
        "hardly count, and errors come from the residuals' own spread. Look for mistracked points.",
        record.robust->wild));
  } else if (record.outliers_5sigma > 0) {
    remarks.push_back(
        fmt::format("{} residuals are beyond 5 standard deviations; chance makes one in two million. Look "
                    "for mistracked points.",
                    record.outliers_5sigma));
  }
  return remarks;
}

}  // namespace diastole
