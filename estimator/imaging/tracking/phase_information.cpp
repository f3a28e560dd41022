#include "estimator/imaging/tracking/phase_information.hpp"

#include <algorithm>

namespace diastole::imaging {

PhaseInformationSum::PhaseInformationSum(int splines)
    : all_{Eigen::MatrixXd::Zero(splines, splines), Eigen::VectorXd::Zero(splines)},
      squares_(Eigen::Matrix4d::Zero()),
      products_(Eigen::Vector4d::Zero()) {}

void PhaseInformationSum::add(const SplineValues& splines, double weight, double value) {
  if (splines.across != run_.across || splines.index != run_.index) {
    end_run();
    run_ = splines;
  }
  const Eigen::Map<const Eigen::Vector4d> down(splines.down.data());
  squares_ += (weight * down) * down.transpose();
  products_ += value * down;
}

void PhaseInformationSum::end_run() {
  for (size_t i = 0; i < 16; ++i) {
    const int a = run_.index[i];
    if (a < 0) continue;
    const auto i_down = static_cast<Eigen::Index>(i / 4);
    all_.vector[a] += run_.across[i % 4] * products_[i_down];
    for (size_t j = 0; j <= i; ++j) {
      const int b = run_.index[j];
      if (b >= 0)
        all_.precision(std::max(a, b), std::min(a, b)) +=
            run_.across[i % 4] * run_.across[j % 4] * squares_(i_down, static_cast<Eigen::Index>(j / 4));
    }
  }
  squares_.setZero();
  products_.setZero();
}

PhaseInformation PhaseInformationSum::take() {
  end_run();
  all_.precision.triangularView<Eigen::StrictlyUpper>() = all_.precision.transpose();
  return std::move(all_);
}

}  // namespace diastole::imaging
