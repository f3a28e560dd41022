#include "estimator/shaping/drive_bounds.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace diastole::shaping {
namespace {

using std::numbers::pi;

struct Peaks {
  double least_mL, most_mL, flow_mL_s, acceleration_mL_s2;
};

size_t grid_of(const PeriodicCurve& curve) { return static_cast<size_t>(8 * curve.harmonics() + 8); }

Peaks peaks_of(const PeriodicCurve& drive) {
  const auto largest = [&](int order) {
    double most = 0.0;
    for (const double value : drive.at_even(grid_of(drive), order))
      most = std::max(most, std::abs(value));
    return most;
  };
  const std::vector<double> volume = drive.at_even(grid_of(drive));
  return {std::ranges::min(volume), std::ranges::max(volume), largest(1), largest(2)};
}

/// min 1/2 |slope (x - wanted)|^2 with low <= rows x <= high.
struct Programme {
  Eigen::VectorXd wanted;
  Eigen::MatrixXd rows;
  Eigen::VectorXd low, high;
};

Eigen::VectorXd solved(const Programme& given, const Eigen::MatrixXd& slope) {
  constexpr int most_rounds = 4000, look_every = 50;
  constexpr double close = 1e-6, relaxation = 1.6, regular = 1e-6;
  const Eigen::MatrixXd weight = slope.transpose() * slope, square = given.rows.transpose() * given.rows;
  double rho = 0.1 * weight.trace() / static_cast<double>(weight.rows());
  Eigen::LLT<Eigen::MatrixXd> factor;
  const auto refactor = [&] {
    Eigen::MatrixXd matrix = weight + rho * square;
    matrix.diagonal().array() += regular;
    factor.compute(matrix);
  };
  refactor();
  const Eigen::VectorXd target = weight * given.wanted;
  Eigen::VectorXd x = given.wanted;
  Eigen::VectorXd z = (given.rows * x).cwiseMax(given.low).cwiseMin(given.high);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(z.size());
  for (int round = 1; round <= most_rounds; ++round) {
    x = factor.solve(target + regular * x + given.rows.transpose() * (rho * z - y));
    const Eigen::VectorXd reached = given.rows * x;
    const Eigen::VectorXd mixed = relaxation * reached + (1.0 - relaxation) * z;
    z = (mixed + y / rho).cwiseMax(given.low).cwiseMin(given.high);
    y += rho * (mixed - z);
    if (round % look_every != 0) continue;
    const Eigen::VectorXd pull = weight * x - target, push = given.rows.transpose() * y;
    const double primal = (reached - z).cwiseAbs().maxCoeff(), dual = (pull + push).cwiseAbs().maxCoeff();
    const double force = std::max({pull.cwiseAbs().maxCoeff(), push.cwiseAbs().maxCoeff(), 1e-12});
    if (primal < close && dual < close * force) break;
    const double change = std::sqrt(primal / std::max(dual / force, 1e-12));
    if (change > 5.0 || change < 0.2) {
      rho *= std::clamp(change, 0.1, 10.0);
      refactor();
    }
  }
  return x;
}

/// With unit volume `size_mL`, rows as parts of what is allowed.
Programme programme_of(const PeriodicCurve& drive, const DriveBounds& bounds, double flow_mL_s,
                       double acceleration_mL_s2, double size_mL) {
  const Eigen::Index count = drive.harmonics();
  const auto grid = static_cast<Eigen::Index>(grid_of(drive));
  Programme made{.wanted = numbers_of(drive) / size_mL,
                 .rows = Eigen::MatrixXd::Zero(3 * grid, 2 * count + 1),
                 .low = Eigen::VectorXd::Constant(3 * grid, -1.0),
                 .high = Eigen::VectorXd::Ones(3 * grid)};
  made.low.head(grid).setConstant(bounds.least_mL / size_mL);
  made.high.head(grid).setConstant(bounds.most_mL / size_mL);
  made.rows.block(0, 0, grid, 1).setOnes();
  for (Eigen::Index k = 1; k <= count; ++k) {
    const double omega = 2.0 * pi * drive.frequency_Hz(k);
    const double by_flow = omega * size_mL / flow_mL_s;
    const double by_acceleration = omega * omega * size_mL / acceleration_mL_s2;
    for (Eigen::Index j = 0; j < grid; ++j) {
      const double turn = 2.0 * pi * static_cast<double>(k * j) / static_cast<double>(grid);
      const double real = std::numbers::sqrt2 * std::cos(turn),
                   imaginary = -std::numbers::sqrt2 * std::sin(turn);
      made.rows.block(j, 2 * k - 1, 1, 2) << real, imaginary;
      made.rows.block(grid + j, 2 * k - 1, 1, 2) << by_flow * imaginary, -by_flow * real;
      made.rows.block(2 * grid + j, 2 * k - 1, 1, 2) << -by_acceleration * real, -by_acceleration * imaginary;
    }
  }
  return made;
}

}  // namespace

bool within(const PeriodicCurve& drive_mL, const DriveBounds& bounds) {
  constexpr double rounding_mL = 1e-9;
  const Peaks peaks = peaks_of(drive_mL);
  return peaks.least_mL >= bounds.least_mL - rounding_mL && peaks.most_mL <= bounds.most_mL &&
         peaks.flow_mL_s <= bounds.flow_mL_s &&
         peaks.acceleration_mL_s2 <= bounds.acceleration_mL_s2(peaks.flow_mL_s);
}

PeriodicCurve nearest_within(const PeriodicCurve& drive_mL, const Eigen::MatrixXd& slope,
                             const DriveBounds& bounds) {
  if (within(drive_mL, bounds)) return drive_mL;
  constexpr int flows = 10;
  const double size_mL = std::max(drive_mL.range(), 1e-6);
  const double fastest = std::min(bounds.flow_mL_s, peaks_of(drive_mL).flow_mL_s);
  PeriodicCurve best = drive_mL;
  double least = std::numeric_limits<double>::infinity();
  for (int part = flows; part > 0; --part) {
    const double flow_mL_s = fastest * static_cast<double>(part) / flows;
    const double acceleration = bounds.acceleration_mL_s2(flow_mL_s);
    if (!(acceleration > 0.0)) continue;
    const Programme programme = programme_of(drive_mL, bounds, flow_mL_s, acceleration, size_mL);
    const Eigen::VectorXd x = solved(programme, slope);
    const double cost = (slope * (x - programme.wanted)).squaredNorm();
    if (cost > 1.02 * least) break;  // beyond the best flow
    if (cost >= least) continue;
    least = cost;
    best = curve_of(size_mL * x, drive_mL.period_s);
  }
  return best;
}

}  // namespace diastole::shaping
