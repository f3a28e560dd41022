#include "protocol/signal/step_fit.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <unsupported/Eigen/NonLinearOptimization>
#include <unsupported/Eigen/NumericalDiff>

#include "protocol/signal/step_search.hpp"

namespace diastole::signal {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int parameters = 5;  // p0, dp, t0, ln f0, ln zeta
constexpr int correlated_rows = 20;
constexpr double most_f0_of_rate = 0.45;
constexpr double excess_rms = 3;
constexpr double normal_975 = 1.959964;

struct Misfit {
  using Scalar = double;
  using InputType = VectorXd;
  using ValueType = VectorXd;
  using JacobianType = MatrixXd;
  static constexpr int InputsAtCompileTime = Eigen::Dynamic;
  static constexpr int ValuesAtCompileTime = Eigen::Dynamic;

  std::span<const double> time_s;
  std::span<const double> pressure_kPa;

  [[nodiscard]] int inputs() const { return parameters; }
  [[nodiscard]] int values() const { return static_cast<int>(time_s.size()); }
  int operator()(const VectorXd& at, VectorXd& misfit) const {
    const SecondOrder system{std::exp(at[3]), std::exp(at[4])};
    for (size_t i = 0; i < time_s.size(); ++i) {
      misfit[static_cast<Eigen::Index>(i)] =
          at[0] + at[1] * unit_step(system, time_s[i] - at[2]) - pressure_kPa[i];
    }
    return 0;
  }
};

/// The best of a grid over f0, zeta and t0, levels as found.
VectorXd first_guess(const Misfit& misfit, const FoundStep& step, double spacing_s, double onset_s) {
  VectorXd best(parameters), left(misfit.values());
  double least = HUGE_VAL;
  for (const double f0_Hz : {4, 8, 15, 25, 40, 60, 90, 130}) {
    if (f0_Hz * spacing_s > most_f0_of_rate) continue;
    for (const double zeta : {0.1, 0.3, 0.6, 1.0, 2.0}) {
      for (const double early : {0.0, 1.0, 2.0, 4.0}) {
        VectorXd at(parameters);
        at << step.before_kPa, step.after_kPa - step.before_kPa, onset_s - early * spacing_s, std::log(f0_Hz),
            std::log(zeta);
        misfit(at, left);
        if (left.squaredNorm() >= least) continue;
        least = left.squaredNorm();
        best = at;
      }
    }
  }
  return best;
}

/// (J'J)^-1 J' G J (J'J)^-1 with the tapered autocovariance of the residuals.
MatrixXd covariance(const MatrixXd& jacobian, const VectorXd& left) {
  const Eigen::Index n = left.size();
  const double freedom = static_cast<double>(n) / static_cast<double>(n - parameters);
  MatrixXd meat = MatrixXd::Zero(parameters, parameters);
  for (int lag = 0; lag <= std::min<int>(correlated_rows, static_cast<int>(n) - 1); ++lag) {
    const double taper = 1 - lag / (correlated_rows + 1.0);
    const double g = left.head(n - lag).dot(left.tail(n - lag)) / static_cast<double>(n) * freedom;
    const MatrixXd product = jacobian.topRows(n - lag).transpose() * jacobian.bottomRows(n - lag);
    meat += taper * g * (lag == 0 ? product : MatrixXd(product + product.transpose()));
  }
  const MatrixXd bread =
      (jacobian.transpose() * jacobian).ldlt().solve(MatrixXd::Identity(parameters, parameters));
  return bread * meat * bread;
}

/// Of a positive quantity, from the standard error of its logarithm.
Estimate from_log(double value, double log_se, double quantile) {
  return {value, value * log_se, {value * std::exp(-quantile * log_se), value * std::exp(quantile * log_se)}};
}

FittedStep fit_step(std::span<const double> time_s, std::span<const double> pressure_kPa,
                    const FoundStep& step, double spacing_s) {
  const size_t rows = step.last - step.first;
  // Times relative to the onset: Jacobians by differences need numbers of order one.
  std::vector<double> local_s;
  for (size_t i = step.first; i < step.last; ++i)
    local_s.push_back(time_s[i] - time_s[step.onset]);
  const Misfit misfit{local_s, pressure_kPa.subspan(step.first, rows)};
  VectorXd at = first_guess(misfit, step, spacing_s, 0);
  Eigen::NumericalDiff<Misfit, Eigen::Central> differentiable(misfit);
  Eigen::LevenbergMarquardt<decltype(differentiable)> search(differentiable);
  search.parameters.maxfev = 4000;
  search.minimize(at);
  VectorXd left(misfit.values());
  misfit(at, left);
  MatrixXd jacobian(misfit.values(), parameters);
  differentiable.df(at, jacobian);
  const MatrixXd cov = covariance(jacobian, left);
  const boost::math::students_t student(static_cast<double>(rows - parameters));
  const double quantile = boost::math::quantile(student, 0.975);
  return {.time_s = time_s[step.onset] + at[2],
          .before_kPa = at[0],
          .jump_kPa = at[1],
          .f0_Hz = from_log(std::exp(at[3]), std::sqrt(cov(3, 3)), quantile),
          .zeta = from_log(std::exp(at[4]), std::sqrt(cov(4, 4)), quantile),
          .rms_kPa = std::sqrt(left.squaredNorm() / static_cast<double>(rows)),
          .noise_kPa = step.noise_kPa,
          .first = step.first,
          .last = step.last,
          .log_covariance = {cov(3, 3), cov(3, 4), cov(4, 3), cov(4, 4)}};
}

/// Why a step cannot be used; empty if it can.
std::string fault_of(const FittedStep& step, double spacing_s) {
  if (!std::isfinite(step.f0_Hz.se) || !std::isfinite(step.zeta.se)) return "its fit did not converge";
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
  return from_log(std::exp(log_at(0, 0)), std::sqrt(gradient.dot(mean.covariance * gradient)), normal_975);
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
    const FittedStep step = fit_step(time_s, pressure_kPa, found, spacing_s);
    if (const std::string fault = fault_of(step, spacing_s); !fault.empty()) {
      response.remarks.push_back(fmt::format("the step at {:.3f} s is left out: {}", at_s, fault));
      continue;
    }
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
