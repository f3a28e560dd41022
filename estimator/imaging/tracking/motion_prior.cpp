#include "estimator/imaging/tracking/motion_prior.hpp"

#include <cmath>
#include <limits>

namespace diastole::imaging {
namespace {

/// Each step of expectation maximisation raises the evidence; by then its gain is below a thousandth a coefficient.
constexpr int steps = 60;
/// The ranges are told apart long before.
constexpr int steps_to_choose = 12;
/// What the images know less of than a hundredth of what the prior says of a millimetre teaches nothing.
constexpr double least_strength = 0.01;

/// The phases' information in the splines' common eigenmodes: V' R V = 1, V' mean(H) V = diag(strength).
struct Modes {
  Eigen::VectorXd strength;  // n
  Eigen::MatrixXd vector;    // n x T: V' eta
  Eigen::VectorXd weight;    // T: how much each phase knows, relative to the mean
};

Modes common_modes(const Eigen::MatrixXd& place_precision, const std::vector<PhaseInformation>& phases,
                   const Eigen::MatrixXd& estimates) {
  const auto count = place_precision.rows();
  const auto times = static_cast<Eigen::Index>(phases.size());
  Modes modes;
  modes.weight.resize(times);
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index k = 0; k < times; ++k) {
    modes.weight[k] = phases[static_cast<size_t>(k)].precision.trace();
    mean += phases[static_cast<size_t>(k)].precision;
  }
  mean /= static_cast<double>(times);
  modes.weight /= std::max(modes.weight.mean(), 1e-300);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(mean, place_precision);
  const Eigen::Index seen = (solver.eigenvalues().array() > least_strength).count();
  modes.strength = solver.eigenvalues().tail(seen);
  // Each phase is taken to know the same modes, all of them better or worse: its estimate, as sure as that.
  modes.vector = modes.strength.asDiagonal() *
                 (solver.eigenvectors().rightCols(seen).transpose() * place_precision * estimates) *
                 modes.weight.asDiagonal();
  return modes;
}

struct Learnt {
  Eigen::MatrixXd covariance;
  double log_evidence;
};

/// One step: the expected second moment of the modes given `covariance`, and the evidence of `covariance`.
Learnt expect(const Modes& modes, const Eigen::MatrixXd& covariance) {
  const Eigen::Index times = covariance.rows();
  Eigen::MatrixXd moment = Eigen::MatrixXd::Zero(times, times);
  double log_evidence = 0;
  for (Eigen::Index i = 0; i < modes.strength.size(); ++i) {
    const Eigen::VectorXd known = (modes.strength[i] * modes.weight).cwiseSqrt();
    // With D = diag(known^2): posterior = K - K d (1 + d K d)^-1 d K.
    const Eigen::MatrixXd scaled = known.asDiagonal() * covariance;
    Eigen::MatrixXd inner = scaled * known.asDiagonal();
    inner.diagonal().array() += 1.0;
    const Eigen::LLT<Eigen::MatrixXd> factor(inner);
    const Eigen::MatrixXd half = factor.matrixL().solve(scaled);
    const Eigen::MatrixXd posterior = covariance - half.transpose() * half;
    const Eigen::VectorXd mean = posterior * modes.vector.row(i).transpose();
    moment += posterior + mean * mean.transpose();
    const Eigen::MatrixXd lower = factor.matrixL();
    log_evidence += 0.5 * modes.vector.row(i).dot(mean) - lower.diagonal().array().log().sum();
  }
  moment /= static_cast<double>(modes.strength.size());
  return {0.5 * (moment + moment.transpose()), log_evidence};
}

/// The modes of K without those whose share of the motion, which is `motion_mm` (root mean square), is negligible; what each phase
/// loses by that goes to the prior's `left_out_mm`.
void keep_strong_modes(MotionPrior& prior, double motion_mm, double negligible_mm) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(prior.time_covariance);
  const Eigen::VectorXd variances = solver.eigenvalues().cwiseMax(0.0);
  const double mm2_per_unit = motion_mm * motion_mm / std::max(prior.time_covariance.trace(), 1e-300);
  Eigen::Index left_out = 0;
  while (left_out + 1 < variances.size() &&
         variances[left_out] * mm2_per_unit < negligible_mm * negligible_mm)
    ++left_out;
  const Eigen::Index kept = variances.size() - left_out;
  prior.modes = solver.eigenvectors().rightCols(kept) * variances.tail(kept).cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd lost =
      solver.eigenvectors().leftCols(left_out) * variances.head(left_out).cwiseSqrt().asDiagonal();
  prior.left_out_mm =
      (mm2_per_unit * static_cast<double>(variances.size()) * lost.rowwise().squaredNorm()).cwiseSqrt();
}

}  // namespace

MotionPrior learn_motion_prior(const SplinePlane& splines, const std::vector<PhaseInformation>& phases,
                               const Eigen::MatrixXd& estimates, const std::vector<double>& kappas_per_mm,
                               double negligible_mm) {
  const auto times = static_cast<Eigen::Index>(phases.size());
  const double motion_mm = std::sqrt(estimates.array().square().mean());
  MotionPrior best;
  Modes best_modes;
  double best_evidence = -std::numeric_limits<double>::infinity();
  for (const double kappa : kappas_per_mm) {
    const Eigen::MatrixXd precision = splines.precision(kappa);
    const Modes modes = common_modes(precision, phases, estimates);
    // The start: a millimetre of motion, alike over a quarter of the phases.
    Learnt learnt{Eigen::MatrixXd::NullaryExpr(
                      times, times,
                      [times](Eigen::Index a, Eigen::Index b) {
                        const double apart = static_cast<double>(a - b) / static_cast<double>(times);
                        return std::exp(-8.0 * apart * apart) + (a == b ? 1e-5 : 0.0);
                      }),
                  0};
    for (int step = 0; step < steps_to_choose; ++step)
      learnt = expect(modes, learnt.covariance);
    if (learnt.log_evidence <= best_evidence) continue;
    best_evidence = learnt.log_evidence;
    best_modes = modes;
    best.kappa_per_mm = kappa;
    best.place_precision = precision;
    best.time_covariance = learnt.covariance;
  }
  for (int step = steps_to_choose; step < steps; ++step)
    best.time_covariance = expect(best_modes, best.time_covariance).covariance;
  keep_strong_modes(best, motion_mm, negligible_mm);
  return best;
}

}  // namespace diastole::imaging
