#include "estimator/imaging/geometry/phased_fit.hpp"

#include <algorithm>
#include <cmath>

namespace diastole::imaging {

PhasedFit::PhasedFit(const std::vector<PhaseEquations>& equations, Eigen::Index departures)
    : departures_(departures) {
  for (const PhaseEquations& e : equations) {
    Phase phase;
    phase.cc = e.common.transpose() * e.common;
    phase.cy = e.common.transpose() * e.y;
    phase.yy = e.y.squaredNorm();
    phase.rows = static_cast<double>(e.y.size());
    rows_ += e.y.size();
    phases_.push_back(std::move(phase));
  }
}

void PhasedFit::solve(const PhasedPrior& prior) {
  const double weight = 1 / prior.noise_variance;
  const Eigen::VectorXd common_precision = prior.common_variance.cwiseInverse();
  const Eigen::VectorXd departure_precision = prior.departure_variance.cwiseInverse();
  Eigen::MatrixXd information = common_precision.asDiagonal();
  Eigen::VectorXd right = Eigen::VectorXd::Zero(common_precision.size());
  for (Phase& phase : phases_) {
    const auto dc = phase.cc.topRows(departures_);
    Eigen::MatrixXd own = weight * dc.leftCols(departures_);
    own.diagonal() += departure_precision;
    phase.inverse = own.llt().solve(Eigen::MatrixXd::Identity(departures_, departures_));
    phase.gain = weight * phase.inverse * dc;
    information += weight * (phase.cc - dc.transpose() * phase.gain);
    right += weight * (phase.cy - phase.gain.transpose() * phase.cy.head(departures_));
  }
  common_covariance_ =
      information.llt().solve(Eigen::MatrixXd::Identity(information.rows(), information.cols()));
  common_ = common_covariance_ * right;

  departure_squares_ = Eigen::VectorXd::Zero(departures_);
  double squares = 0;
  // Of each unknown the data determine the share 1 - posterior / prior variance.
  double determined =
      static_cast<double>(common_.size()) - common_covariance_.diagonal().dot(common_precision);
  for (Phase& phase : phases_) {
    phase.departure = weight * phase.inverse * phase.cy.head(departures_) - phase.gain * common_;
    const Eigen::VectorXd variance =
        phase.inverse.diagonal() + (phase.gain * common_covariance_).cwiseProduct(phase.gain).rowwise().sum();
    departure_squares_ += phase.departure.cwiseAbs2() + variance;
    determined += static_cast<double>(departures_) - variance.dot(departure_precision);
    Eigen::VectorXd all = common_;
    all.head(departures_) += phase.departure;
    squares += phase.yy - 2 * phase.cy.dot(all) + all.dot(phase.cc * all);
  }
  noise_square_ = squares + prior.noise_variance * determined;
}

Eigen::VectorXd PhasedFit::square_of_common() const {
  return common_.cwiseAbs2() + common_covariance_.diagonal();
}

double PhasedFit::rms_of(size_t phase, const Eigen::VectorXd& common) const {
  const Phase& p = phases_[phase];
  const Eigen::Index count = common.size();
  if (p.rows == 0) return 0;
  return std::sqrt(std::max(0.0, common.dot(p.cc.topLeftCorner(count, count) * common)) / p.rows);
}

Eigen::MatrixXd PhasedFit::covariance(size_t phase, const Eigen::MatrixXd& of_common,
                                      const Eigen::MatrixXd& of_departure) const {
  const Phase& p = phases_[phase];
  const Eigen::MatrixXd by_common = of_common - of_departure * p.gain;
  return of_departure * p.inverse * of_departure.transpose() +
         by_common * common_covariance_ * by_common.transpose();
}

}  // namespace diastole::imaging
