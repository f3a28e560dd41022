#include "estimator/law_fit/law_fit.hpp"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <optional>

#include "estimator/inference/covariance.hpp"
#include "estimator/inference/intervals.hpp"
#include "estimator/inference/least_squares.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double doubt = 0.05;         // of intervals
constexpr double strong_doubt = 3.29;  // standard deviations: one in a thousand, of remarks
constexpr double lost = 0.5;      // relative standard deviation whose interval of 95 % reaches down to zero
constexpr double unseen = 1e-10;  // singular value over the greatest, as in estimate_covariance
constexpr double worth_naming = 0.05;  // part of a combination
constexpr double no_bound = -1e100;    // LawParameter::above of laws whose parameters may be negative
constexpr double rounding = 1e-7;      // relative scatter below which only arithmetic is seen
constexpr double same_cost = 1e-3;     // relative, of searches that found the same

size_t count_of(std::span<const BenchTest> tests) {
  size_t count = 0;
  for (const BenchTest& test : tests)
    count += test.readings.size() * test.channels.size();
  return count;
}

/// Rows are predictions over their columns' RMS, columns LawAt's parts; none where a test has no equilibrium.
std::optional<MatrixXd> predictions(const LawAt& law, std::span<const BenchTest> tests) {
  MatrixXd all(static_cast<Index>(count_of(tests)), static_cast<Index>(law.parts()));
  Index row = 0;
  for (const BenchTest& test : tests) {
    for (const Reading& reading : test.readings) {
      const auto predicted = test.kind->predict(law, reading.controls, reading.fibre_rad);
      if (!predicted) return std::nullopt;
      for (size_t i = 0; i < test.channels.size(); ++i)
        all.row(row++) = predicted->row(static_cast<Index>(i)) / test.channels[i].rms;
    }
  }
  return all.allFinite() ? std::optional(std::move(all)) : std::nullopt;
}

VectorXd measurements(std::span<const BenchTest> tests) {
  VectorXd all(static_cast<Index>(count_of(tests)));
  Index row = 0;
  for (const BenchTest& test : tests) {
    for (const Reading& reading : test.readings) {
      for (size_t i = 0; i < test.channels.size(); ++i)
        all[row++] = reading.measured[i] / test.channels[i].rms;
    }
  }
  return all;
}

/// Coordinates are values in units of where the search starts, so that a bound is one of order one.
class LawProblem final : public inference::LeastSquaresProblem {
 public:
  LawProblem(const Law& law, std::vector<double> units, std::span<const BenchTest> tests)
      : law_(law), tests_(tests), units_(std::move(units)), measured_(measurements(tests)) {
    constexpr double beyond_the_bound = 1e-8, farthest = 1e3;
    std::vector<inference::Parameter> parameters;
    for (size_t i = 0; i < units_.size(); ++i) {
      const LawParameter& parameter = law.parameters()[i];
      const double lower =
          parameter.above > no_bound ? parameter.above / units_[i] + beyond_the_bound : -farthest;
      const double upper = std::min(farthest, parameter.at_most / units_[i]);
      parameters.push_back({std::string(parameter.name), {}, lower, upper});
    }
    space_ = inference::ParameterSpace(std::move(parameters));
  }

  const inference::ParameterSpace& space() const override { return space_; }

  std::optional<VectorXd> residuals(const VectorXd& q) override {
    // With slopes: a law may have a stress where it has none of them, and no search goes on from there.
    const auto values = values_at(q);
    const auto predicted = predictions({law_, values, LawAt::Slopes::given}, tests_);
    if (!predicted) return std::nullopt;
    return VectorXd(predicted->col(0) - measured_);
  }

  MatrixXd jacobian(const VectorXd& q) override {
    const auto values = values_at(q);
    return predictions({law_, values, LawAt::Slopes::given}, tests_).value().rightCols(q.size()) *
           Eigen::Map<const VectorXd>(units_.data(), q.size()).asDiagonal();
  }

  [[nodiscard]] std::vector<double> values_at(const VectorXd& q) const {
    std::vector<double> values;
    for (size_t i = 0; i < units_.size(); ++i)
      values.push_back(q[static_cast<Index>(i)] * units_[i]);
    return values;
  }
  [[nodiscard]] double unit(size_t i) const { return units_[i]; }

 private:
  const Law& law_;
  std::span<const BenchTest> tests_;
  std::vector<double> units_;
  inference::ParameterSpace space_;
  VectorXd measured_;
};

/// By what the moduli must be multiplied so that each column's predictions are as large as its measurements, on average; none
/// if the law has no answer here.
std::optional<double> stiffer_by(const Law& law, const std::vector<double>& values,
                                 std::span<const BenchTest> tests) {
  const auto predicted = predictions({law, values, LawAt::Slopes::left_out}, tests);
  if (!predicted) return std::nullopt;
  double logarithms = 0, columns = 0;
  Index row = 0;
  for (const BenchTest& test : tests) {
    const auto width = static_cast<Index>(test.channels.size());
    for (Index i = 0; i < width; ++i) {
      double squares = 0;
      for (Index reading = 0; reading < std::ssize(test.readings); ++reading)
        squares += std::pow((*predicted)(row + reading * width + i, 0), 2);
      if (squares == 0) continue;
      const double ratio = std::sqrt(static_cast<double>(test.readings.size()) / squares);
      logarithms += test.kind->measures_motion ? -std::log(ratio) : std::log(ratio);
      ++columns;
    }
    row += std::ssize(test.readings) * width;
  }
  return columns > 0 ? std::optional(std::exp(logarithms / columns)) : std::nullopt;
}

/// Values with which a search starts: typical exponents times one of a few factors, since the cost of a law with exponents has
/// several minima, and moduli as stiff as the specimen.
std::vector<std::vector<double>> starts_of(const Law& law, std::span<const BenchTest> tests) {
  const auto parameters = law.parameters();
  const bool has_exponents = !std::ranges::all_of(parameters, &LawParameter::is_modulus);
  std::vector<std::vector<double>> starts;
  for (const double times : {1.0, 0.3, 0.1, 0.03, 3.0}) {
    if (!has_exponents && !starts.empty()) break;
    std::vector<double> values;
    for (const LawParameter& parameter : parameters)
      values.push_back(parameter.typical * (parameter.is_modulus() ? 1 : times));
    const auto factor = stiffer_by(law, values, tests);
    if (!factor) continue;
    for (size_t i = 0; i < values.size(); ++i)
      values[i] *= parameters[i].is_modulus() ? *factor : 1;
    starts.push_back(std::move(values));
  }
  return starts;
}

/// A search from one start, in its own units.
struct Search {
  std::unique_ptr<LawProblem> problem;
  inference::SearchResult result;
  [[nodiscard]] double cost() const { return result.cost(); }
};

/// The best of all; without a problem where the law has no answer at any start.
Search best_search(LawFit& fit, std::span<const BenchTest> tests, const LawFitOptions& options) {
  inference::SearchOptions how;
  how.iteration_limit = 200;
  how.interrupted = options.interrupted;
  std::vector<Search> found;
  for (const std::vector<double>& start : starts_of(*fit.law, tests)) {
    if (options.interrupted && options.interrupted() && !found.empty()) break;
    std::vector<double> units;
    VectorXd q(std::ssize(start));
    for (size_t i = 0; i < start.size(); ++i) {
      units.push_back(start[i] == 0 ? 1 : std::abs(start[i]));
      q[static_cast<Index>(i)] = start[i] / units[i];
    }
    Search search{std::make_unique<LawProblem>(*fit.law, std::move(units), tests), {}};
    search.result = minimise(*search.problem, q, how);
    if (search.result.residuals.size() > 0) found.push_back(std::move(search));
  }
  if (found.empty()) return {};
  const auto best = std::ranges::min_element(found, {}, &Search::cost);
  fit.starts = static_cast<int>(found.size());
  fit.agreeing = static_cast<int>(std::ranges::count_if(
      found, [&](const Search& each) { return each.cost() <= (1 + same_cost) * best->cost(); }));
  return std::move(*best);
}

/// Directions in the space of relative changes along which the data's errors reach over the values themselves.
void find_undetermined(LawFit& fit, const MatrixXd& jacobian, const VectorXd& q,
                       const std::vector<bool>& is_free, double sd) {
  std::vector<Index> place;
  for (Index i = 0; i < q.size(); ++i)
    if (is_free[static_cast<size_t>(i)]) place.push_back(i);
  if (place.empty()) return;
  const VectorXd size = q(place).cwiseAbs();
  const MatrixXd relative = jacobian(Eigen::all, place) * size.asDiagonal();
  const Eigen::JacobiSVD<MatrixXd> svd(relative, Eigen::ComputeFullV);
  const VectorXd& values = svd.singularValues();
  for (Index k = 0; k < std::ssize(place); ++k) {
    const double value = k < values.size() ? values[k] : 0;
    const bool is_seen = value > unseen * values[0];
    VectorXd change = svd.matrixV().col(k);
    Index largest = 0;
    const double most = change.cwiseAbs().maxCoeff(&largest);
    const double spread = is_seen ? most * sd / value : std::numeric_limits<double>::infinity();
    if (spread <= lost) continue;
    change /= change[largest];
    Undetermined& found = fit.undetermined.emplace_back();
    found.sd_percent = 100 * spread;
    for (Index i = 0; i < change.size(); ++i) {
      if (std::abs(change[i]) < worth_naming) continue;
      found.change_percent.emplace_back(
          fit.parameters[static_cast<size_t>(place[static_cast<size_t>(i)])].name, change[i]);
    }
  }
}

void set_estimate(LawFit& fit, const LawProblem& problem, const inference::SearchResult& found) {
  const std::vector<double> values = problem.values_at(found.q);
  const std::vector<bool> is_free = problem.space().free_unknowns(found.q);
  const double squares = found.residuals.squaredNorm();
  const auto count = static_cast<double>(found.residuals.size());
  fit.dof = count - static_cast<double>(std::ranges::count(is_free, true));
  fit.error_percent = 100 * std::sqrt(squares / count);
  const double sd = std::sqrt(squares / fit.dof);
  const MatrixXd covariance = inference::estimate_covariance(found.jacobian, is_free).matrix;
  fit.correlation = inference::correlation(covariance);
  const double quantile = inference::student_quantile(fit.dof, doubt);
  for (Index i = 0; i < found.q.size(); ++i) {
    const auto at = static_cast<size_t>(i);
    const double se = sd * std::sqrt(covariance(i, i)) * problem.unit(at);
    const LawParameter& parameter = fit.law->parameters()[at];
    const double lower =
        parameter.above > no_bound ? parameter.above : -std::numeric_limits<double>::infinity();
    fit.parameters.push_back({std::string(parameter.name),
                              values[at],
                              se,
                              {std::max(lower, values[at] - quantile * se),
                               std::min(parameter.at_most, values[at] + quantile * se)},
                              problem.space().bound_under(found.q, i)});
  }
  find_undetermined(fit, found.jacobian, found.q, is_free, sd);
}

void set_channels(LawFit& fit, std::span<const BenchTest> tests, const VectorXd& residuals) {
  Index row = 0;
  for (size_t t = 0; t < tests.size(); ++t) {
    const BenchTest& test = tests[t];
    const auto width = static_cast<Index>(test.channels.size());
    for (Index i = 0; i < width; ++i) {
      ChannelFit& channel = fit.channels.emplace_back();
      channel.test = t;
      channel.channel = static_cast<size_t>(i);
      double squares = 0, mean = 0, about_mean = 0;
      const auto count = static_cast<double>(test.readings.size());
      for (const Reading& reading : test.readings)
        mean += reading.measured[channel.channel] / count;
      for (Index reading = 0; reading < std::ssize(test.readings); ++reading) {
        const double measured = test.readings[static_cast<size_t>(reading)].measured[channel.channel];
        const double residual = residuals[row + reading * width + i] * test.channels[channel.channel].rms;
        channel.predicted.push_back(measured + residual);
        squares += residual * residual;
        about_mean += (measured - mean) * (measured - mean);
      }
      channel.rms = std::sqrt(squares / count);
      channel.r2 = 1 - squares / about_mean;
    }
    row += std::ssize(test.readings) * width;
  }
}

/// How many standard deviations the products of neighbouring residuals lie above what scatter makes of them.
double following(const LawFit& fit, std::span<const BenchTest> tests) {
  double products = 0, pairs = 0;
  for (const ChannelFit& channel : fit.channels) {
    const auto& readings = tests[channel.test].readings;
    for (size_t i = 1; i < readings.size(); ++i) {
      const auto residual = [&](size_t at) {
        return channel.predicted[at] - readings[at].measured[channel.channel];
      };
      products += residual(i) * residual(i - 1) / (channel.rms * channel.rms);
      ++pairs;
    }
  }
  return products / std::sqrt(pairs);
}

void remark(LawFit& fit, std::span<const BenchTest> tests) {
  for (const LawParameterEstimate& parameter : fit.parameters) {
    if (parameter.bound == inference::BoundSide::none) continue;
    const bool is_upper = parameter.bound == inference::BoundSide::upper;
    fit.remarks.push_back(fmt::format("{} rests on its bound, {:.3g}: these data ask for {}.", parameter.name,
                                      parameter.value,
                                      is_upper ? "more" : "no such term, or for less than none"));
  }
  const bool scattered = fit.error_percent > 100 * rounding;
  if (scattered && following(fit, tests) > strong_doubt) {
    fit.remarks.emplace_back(
        "Residuals follow one another: the law misses the curves' shape, and its standard errors are too "
        "small.");
  }
  if (!fit.settled) fit.remarks.push_back(fit.reason);
}

}  // namespace

std::vector<double> LawFit::values() const {
  std::vector<double> values;
  for (const LawParameterEstimate& parameter : parameters)
    values.push_back(parameter.value);
  return values;
}

LawFit fit_law(const Law& law, std::span<const BenchTest> tests, const LawFitOptions& options) {
  LawFit fit;
  fit.law = &law;
  const auto [problem, found] = best_search(fit, tests, options);
  if (!problem) {
    fit.reason =
        "The law has no equilibrium for these tests at any of the values from which the search starts.";
    fit.remarks.push_back(fit.reason);
    return fit;
  }
  fit.settled = is_settled(found.termination);
  fit.reason = found.reason;
  set_estimate(fit, *problem, found);
  set_channels(fit, tests, found.residuals);
  remark(fit, tests);
  return fit;
}

std::string why_not(const Law& law, std::span<const BenchTest> tests) {
  if (count_of(tests) <= law.parameters().size()) {
    return fmt::format("the law {} has {} parameters, and there are {} readings", law.name(),
                       law.parameters().size(), count_of(tests));
  }
  if (!law.needs_axes()) return {};
  for (const BenchTest& test : tests) {
    if (test.kind->fibre_from.empty())
      return fmt::format("{} is a test of laws without directions, and {} has some", test.file, law.name());
    if (!test.has_fibre)
      return fmt::format("{} does not say where the fibre lies, and {} has one", test.file, law.name());
  }
  return {};
}

void check_law(const Law& law, std::span<const BenchTest> tests) {
  const std::string problem = why_not(law, tests);
  if (problem.empty()) return;
  throw InputError({"", "", problem,
                    law.needs_axes()
                        ? "Add the column fibre_deg to each file, or leave the law or the test out."
                        : "Give more readings, or a law with fewer parameters."});
}

VectorXd relative_residuals(const Law& law, std::span<const double> values,
                            std::span<const BenchTest> tests) {
  const auto predicted = predictions({law, values, LawAt::Slopes::left_out}, tests);
  if (!predicted) return {};
  return predicted->col(0) - measurements(tests);
}

}  // namespace diastole
