#include "estimator/catheter/step_fit.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/least_squares.hpp"

namespace diastole::signal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using inference::Parameter;

// Where a pressure signal steps from one quiet level to another.

struct FoundStep {
  size_t onset = 0;  ///< the first sample that has left the level before
  size_t first = 0;  ///< samples [first, last) belong to it: 0.1 s before to 0.6 s after, or to the next step
  size_t last = 0;
  double before_kPa = 0;
  double after_kPa = 0;
  double noise_kPa = 0;  ///< standard deviation of the level before
};

struct StepSearch {
  std::vector<FoundStep> steps;
  std::string nearest;  ///< what came nearest to a step when there is none, in words
};

constexpr double level_s = 0.1;
constexpr double settling_s = 0.3;
constexpr double fast_s = 0.06;
constexpr double fitted_s = 0.6;
constexpr double least_jump_sds = 10;
constexpr double onset_part = 0.1;

struct Level {
  double mean = 0;
  double sd = 0;
};

Level level_of(std::span<const double> values) {
  const auto n = static_cast<double>(values.size());
  Level level;
  for (const double value : values)
    level.mean += value / n;
  for (const double value : values)
    level.sd += (value - level.mean) * (value - level.mean) / (n - 1);
  level.sd = std::sqrt(level.sd);
  return level;
}

struct Lengths {
  size_t level, settling, fast, fitted;
  explicit Lengths(double spacing_s)
      : level(rows(level_s, spacing_s)),
        settling(rows(settling_s, spacing_s)),
        fast(rows(fast_s, spacing_s)),
        fitted(rows(fitted_s, spacing_s)) {}
  static size_t rows(double length_s, double spacing_s) {
    return std::max<size_t>(3, static_cast<size_t>(std::lround(length_s / spacing_s)));
  }
};

/// A step: the means over 0.1 s before it and from 0.3 to 0.4 s after it differ by more than ten times either's
/// standard deviation, and half the difference is there within 60 ms. Missing samples (NaN) make none.
StepSearch find_steps(std::span<const double> pressure_kPa, double spacing_s) {
  const Lengths rows(spacing_s);
  StepSearch search;
  double largest_kPa = 0, largest_s = 0;
  size_t i = rows.level;
  while (i + rows.settling + rows.level <= pressure_kPa.size()) {
    const double change_kPa = std::abs(pressure_kPa[i + rows.fast] - pressure_kPa[i]);
    if (change_kPa > largest_kPa) {
      largest_kPa = change_kPa;
      largest_s = spacing_s * static_cast<double>(i);
    }
    const Level before = level_of(pressure_kPa.subspan(i - rows.level, rows.level));
    const Level after = level_of(pressure_kPa.subspan(i + rows.settling, rows.level));
    const double jump_kPa = after.mean - before.mean;
    const bool quiet = std::abs(jump_kPa) > least_jump_sds * std::max(before.sd, after.sd);
    const bool fast = std::abs(pressure_kPa[i + rows.fast] - before.mean) > 0.5 * std::abs(jump_kPa);
    if (!quiet || !fast) {  // also where a sample is missing
      ++i;
      continue;
    }
    size_t onset = i;
    while (std::abs(pressure_kPa[onset] - before.mean) < onset_part * std::abs(jump_kPa))
      ++onset;
    if (!search.steps.empty()) {
      search.steps.back().last = std::min(search.steps.back().last, onset - rows.level / 2);
    }
    search.steps.push_back({onset, i - rows.level, std::min(onset + rows.fitted, pressure_kPa.size()),
                            before.mean, after.mean, before.sd});
    i = onset + rows.settling + rows.level;
  }
  search.nearest =
      fmt::format("the largest change within 60 ms is {:.3f} kPa, at {:.2f} s", largest_kPa, largest_s);
  return search;
}

constexpr int parameters = 5;
const Parameter f0{"f0_Hz", "Hz", 0, HUGE_VAL, inference::Scale::logarithmic};
const Parameter zeta{"zeta", "", 0, HUGE_VAL, inference::Scale::logarithmic};
constexpr int correlated_rows = 20;
constexpr double most_f0_of_rate = 0.45;
constexpr double excess_rms = 3;

class StepMisfit : public inference::LeastSquaresProblem {
 public:
  StepMisfit(std::vector<double> time_s, std::span<const double> pressure_kPa)
      : time_s_(std::move(time_s)), pressure_kPa_(pressure_kPa) {}

  [[nodiscard]] const inference::ParameterSpace& space() const override { return space_; }
  std::optional<VectorXd> residuals(const VectorXd& q) override {
    const SecondOrder system{f0.value(q[3]), zeta.value(q[4])};
    VectorXd misfit(static_cast<Eigen::Index>(time_s_.size()));
    for (size_t i = 0; i < time_s_.size(); ++i) {
      misfit[static_cast<Eigen::Index>(i)] =
          q[0] + q[1] * unit_step(system, time_s_[i] - q[2]) - pressure_kPa_[i];
    }
    return misfit;
  }
  MatrixXd jacobian(const VectorXd& q) override { return inference::central_differences(*this, q); }

 private:
  std::vector<double> time_s_;  // since the onset: differences need numbers of order one
  std::span<const double> pressure_kPa_;
  inference::ParameterSpace space_{
      std::vector<Parameter>{{"before", "kPa"}, {"jump", "kPa"}, {"time", "s"}, f0, zeta}};
};

/// The best of a grid over f0, zeta and t0, levels as found.
VectorXd first_guess(StepMisfit& misfit, const FoundStep& step, double spacing_s) {
  VectorXd best(parameters);
  double least = HUGE_VAL;
  for (const double f0_Hz : {4, 8, 15, 25, 40, 60, 90, 130}) {
    if (f0_Hz * spacing_s > most_f0_of_rate) continue;
    for (const double damping : {0.1, 0.3, 0.6, 1.0, 2.0}) {
      for (const double early : {0.0, 1.0, 2.0, 4.0}) {
        VectorXd at(parameters);
        at << step.before_kPa, step.after_kPa - step.before_kPa, -early * spacing_s, std::log(f0_Hz),
            std::log(damping);
        const double square = misfit.residuals(at)->squaredNorm();
        if (square >= least) continue;
        least = square;
        best = at;
      }
    }
  }
  return best;
}

/// (J'J)^-1 J' G J (J'J)^-1 with the tapered autocovariance of the residuals.
MatrixXd correlated_covariance(const MatrixXd& jacobian, const VectorXd& left) {
  const Eigen::Index n = left.size();
  const double freedom = static_cast<double>(n) / static_cast<double>(n - parameters);
  MatrixXd meat = MatrixXd::Zero(parameters, parameters);
  for (int lag = 0; lag <= std::min<int>(correlated_rows, static_cast<int>(n) - 1); ++lag) {
    const double taper = 1 - lag / (correlated_rows + 1.0);
    const double g = left.head(n - lag).dot(left.tail(n - lag)) / static_cast<double>(n) * freedom;
    const MatrixXd product = jacobian.topRows(n - lag).transpose() * jacobian.bottomRows(n - lag);
    meat += taper * g * (lag == 0 ? product : MatrixXd(product + product.transpose()));
  }
  const MatrixXd bread = inference::estimate_covariance(jacobian).matrix;
  return bread * meat * bread;
}

Estimate estimate(const Parameter& parameter, double coordinate, double sd, double quantile) {
  return {parameter.value(coordinate), standard_error(parameter, coordinate, sd),
          interval(parameter, coordinate, quantile * sd)};
}

/// Nothing if the search did not settle.
std::optional<FittedStep> fit_step(std::span<const double> time_s, std::span<const double> pressure_kPa,
                                   const FoundStep& step, double spacing_s) {
  const size_t rows = step.last - step.first;
  std::vector<double> local_s;
  for (size_t i = step.first; i < step.last; ++i)
    local_s.push_back(time_s[i] - time_s[step.onset]);
  StepMisfit misfit(std::move(local_s), pressure_kPa.subspan(step.first, rows));
  const inference::SearchResult found = inference::minimise(
      misfit, first_guess(misfit, step, spacing_s), {.iteration_limit = 400, .cost_tolerance = 1e-14});
  if (!is_settled(found.termination)) return {};
  const VectorXd& at = found.q;
  const MatrixXd cov = correlated_covariance(found.jacobian, found.residuals);
  const double quantile = inference::student_quantile(static_cast<double>(rows - parameters), 0.05);
  return FittedStep{.time_s = time_s[step.onset] + at[2],
                    .before_kPa = at[0],
                    .jump_kPa = at[1],
                    .f0_Hz = estimate(f0, at[3], std::sqrt(cov(3, 3)), quantile),
                    .zeta = estimate(zeta, at[4], std::sqrt(cov(4, 4)), quantile),
                    .rms_kPa = std::sqrt(found.residuals.squaredNorm() / static_cast<double>(rows)),
                    .noise_kPa = step.noise_kPa,
                    .first = step.first,
                    .last = step.last,
                    .log_covariance = {cov(3, 3), cov(3, 4), cov(4, 3), cov(4, 4)}};
}

/// Why a step cannot be used; empty if it can.
std::string fault_of(const std::optional<FittedStep>& fitted, double spacing_s) {
  if (!fitted || !std::isfinite(fitted->f0_Hz.se) || !std::isfinite(fitted->zeta.se))
    return "its fit did not converge";
  const FittedStep& step = *fitted;
  if (step.f0_Hz.value * spacing_s > most_f0_of_rate) {
    return fmt::format("its natural frequency of {:.0f} Hz is too near half the sample rate of {:.0f} Hz",
                       step.f0_Hz.value, 1 / spacing_s);
  }
  if (step.f0_Hz.se > step.f0_Hz.value || step.zeta.se > step.zeta.value) {
    return "frequency and damping cannot be told apart in it";
  }
  return {};
}

struct Averaged {
  Eigen::Vector2d log_mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
};

Averaged average(const std::vector<FittedStep>& steps) {
  Eigen::Matrix2d weights = Eigen::Matrix2d::Zero();
  Eigen::Vector2d weighted = Eigen::Vector2d::Zero();
  const auto weight_of = [](const FittedStep& step) {
    return Eigen::Matrix2d(Eigen::Map<const Eigen::Matrix2d>(step.log_covariance.data()).inverse());
  };
  const auto log_of = [](const FittedStep& step) {
    return Eigen::Vector2d(std::log(step.f0_Hz.value), std::log(step.zeta.value));
  };
  for (const FittedStep& step : steps) {
    weights += weight_of(step);
    weighted += weight_of(step) * log_of(step);
  }
  Averaged result;
  result.covariance = weights.inverse();
  result.log_mean = result.covariance * weighted;
  double chi2 = 0;
  for (const FittedStep& step : steps) {
    const Eigen::Vector2d off = log_of(step) - result.log_mean;
    chi2 += off.dot(weight_of(step) * off);
  }
  if (steps.size() > 1) {
    result.covariance *= std::max(1.0, chi2 / (2 * (static_cast<double>(steps.size()) - 1)));
  }
  return result;
}

/// By the gradient in ln f0 and ln zeta, taken numerically.
Estimate derived(const Averaged& mean, double (*quantity)(const SecondOrder&)) {
  const auto log_at = [&](double d_f0, double d_zeta) {
    return std::log(quantity({std::exp(mean.log_mean[0] + d_f0), std::exp(mean.log_mean[1] + d_zeta)}));
  };
  constexpr double h = 1e-4;
  const Eigen::Vector2d gradient((log_at(h, 0) - log_at(-h, 0)) / (2 * h),
                                 (log_at(0, h) - log_at(0, -h)) / (2 * h));
  const Parameter positive{"", "", 0, HUGE_VAL, inference::Scale::logarithmic};
  return estimate(positive, log_at(0, 0), std::sqrt(gradient.dot(mean.covariance * gradient)),
                  inference::normal_95);
}

}  // namespace

CatheterResponse fit_catheter(std::span<const double> time_s, std::span<const double> pressure_kPa) {
  CatheterResponse response;
  if (time_s.size() < 2) {
    response.refusal = "no sample was recorded";
    return response;
  }
  const double spacing_s = (time_s.back() - time_s.front()) / static_cast<double>(time_s.size() - 1);
  const StepSearch search = find_steps(pressure_kPa, spacing_s);
  if (search.steps.empty()) {
    response.refusal = fmt::format("no step between two quiet levels was found; {}", search.nearest);
    return response;
  }
  for (const FoundStep& found : search.steps) {
    const auto rows = pressure_kPa.subspan(found.first, found.last - found.first);
    const double at_s = time_s[found.onset];
    if (std::ranges::any_of(rows, [](double value) { return std::isnan(value); })) {
      response.remarks.push_back(
          fmt::format("the step at {:.3f} s is left out: samples are missing in it", at_s));
      continue;
    }
    const std::optional<FittedStep> fitted = fit_step(time_s, pressure_kPa, found, spacing_s);
    if (const std::string fault = fault_of(fitted, spacing_s); !fault.empty()) {
      response.remarks.push_back(fmt::format("the step at {:.3f} s is left out: {}", at_s, fault));
      continue;
    }
    const FittedStep& step = *fitted;
    if (step.rms_kPa > excess_rms * step.noise_kPa) {
      response.remarks.push_back(fmt::format(
          "the step at {:.3f} s is not quite a second-order response: the fit leaves {:.4f} kPa, the noise "
          "before it is {:.4f} kPa",
          at_s, step.rms_kPa, step.noise_kPa));
    }
    response.steps.push_back(step);
  }
  if (response.steps.empty()) {
    response.refusal = response.remarks.front();
    return response;
  }
  const Averaged mean = average(response.steps);
  response.f0_Hz = derived(mean, [](const SecondOrder& system) { return system.f0_Hz; });
  response.zeta = derived(mean, [](const SecondOrder& system) { return system.zeta; });
  if (response.steps.size() == 1) {
    response.f0_Hz = response.steps.front().f0_Hz;
    response.zeta = response.steps.front().zeta;
  }
  response.minus_3dB_Hz = derived(mean, minus_3dB_Hz);
  response.lag_limit_Hz = derived(mean, lag_limit_Hz);
  response.flat_limit_Hz = derived(mean, flat_limit_Hz);
  response.delay_s = derived(mean, delay_s);
  return response;
}

}  // namespace diastole::signal
