#include "estimator/inference/covariance.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>

namespace diastole::inference {
namespace {

constexpr double unseen = 1e-10;       // singular value over the greatest: its combination is not determined
constexpr double involved = 1e-4;      // entry of such a combination, from which on an unknown belongs to it
constexpr double worth_a_word = 0.05;  // the same, in words

using Eigen::Index;

using Decomposition = Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>;

/// Right singular vectors and values, by way of R: a singular value of J is one of R.
Decomposition decomposed(const Eigen::MatrixXd& columns) {
  const Index rows = std::min(columns.rows(), columns.cols());
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
  R.topRows(rows) =
      Eigen::HouseholderQR<Eigen::MatrixXd>(columns).matrixQR().topRows(rows).triangularView<Eigen::Upper>();
  return Decomposition(R, Eigen::ComputeFullV);
}

}  // namespace

Covariance estimate_covariance(const Eigen::MatrixXd& jacobian, const std::vector<bool>& is_free) {
  const Index count = jacobian.cols();
  Covariance result{Eigen::MatrixXd::Zero(count, count)};
  std::vector<Index> place;
  for (Index i = 0; i < count; ++i) {
    if (is_free[static_cast<size_t>(i)]) place.push_back(i);
  }
  if (place.empty()) return result;
  Eigen::MatrixXd scaled = jacobian(Eigen::all, place);
  Eigen::VectorXd length = scaled.colwise().norm();
  length = (length.array() > 0).select(length, 1.0);
  scaled *= length.cwiseInverse().asDiagonal();
  const auto svd = decomposed(scaled);
  const auto free_count = static_cast<Index>(place.size());
  Eigen::VectorXd variance = Eigen::VectorXd::Zero(free_count);  // of the combinations
  Eigen::VectorXd is_unseen = Eigen::VectorXd::Zero(free_count);
  for (Index k = 0; k < free_count; ++k) {
    const double size = svd.singularValues()[k];
    if (size > unseen * svd.singularValues()[0]) {
      variance[k] = 1.0 / (size * size);
      continue;
    }
    is_unseen = is_unseen.cwiseMax(svd.matrixV().col(k).cwiseAbs());
    const Eigen::VectorXd change = svd.matrixV().col(k).cwiseQuotient(length);
    Index largest = 0;
    change.cwiseAbs().maxCoeff(&largest);
    Eigen::VectorXd& combination = result.undetermined.emplace_back(Eigen::VectorXd::Zero(count));
    combination(place) = change / change[largest];
  }
  Eigen::MatrixXd covariance = svd.matrixV() * variance.asDiagonal() * svd.matrixV().transpose();
  covariance = length.cwiseInverse().asDiagonal() * covariance * length.cwiseInverse().asDiagonal();
  for (Index k = 0; k < free_count; ++k) {
    if (is_unseen[k] < involved) continue;
    covariance.row(k).setZero();
    covariance.col(k).setZero();
    covariance(k, k) = std::numeric_limits<double>::infinity();
  }
  result.matrix(place, place) = covariance;
  return result;
}

Covariance estimate_covariance(const Eigen::MatrixXd& jacobian) {
  return estimate_covariance(jacobian, std::vector<bool>(static_cast<size_t>(jacobian.cols()), true));
}

std::string in_words(const Eigen::VectorXd& combination, const ParameterSpace& space) {
  std::vector<std::string> parts;
  for (Index i = 0; i < space.size(); ++i) {
    if (std::abs(combination[i]) < worth_a_word) continue;
    const Parameter& parameter = space[i];
    const std::string name = parameter.scale == Scale::logarithmic      ? "ln " + parameter.name
                             : parameter.scale == Scale::inverse_square ? parameter.name + "^-2"
                                                                        : parameter.name;
    parts.push_back(fmt::format("{} {:+.2g}", name, combination[i]));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

Eigen::MatrixXd correlation(const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Identity(covariance.rows(), covariance.cols());
  const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
  for (Index i = 0; i < result.rows(); ++i) {
    for (Index j = 0; j < result.cols(); ++j) {
      const double product = sd[i] * sd[j];
      if (i != j) result(i, j) = product > 0 && std::isfinite(product) ? covariance(i, j) / product : 0.0;
    }
  }
  return result;
}

double effective_count(const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& data_jacobian) {
  double count = 0;
  const Eigen::MatrixXd information = data_jacobian.transpose() * data_jacobian;
  for (Index i = 0; i < covariance.rows(); ++i) {
    if (std::isfinite(covariance(i, i))) count += covariance.row(i).dot(information.col(i));
  }
  return count;
}

}  // namespace diastole::inference
