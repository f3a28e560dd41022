#include "estimator/imaging/tracking/motion_prior.hpp"

#include <cmath>
#include <limits>

namespace diastole::imaging {
namespace {

/// A step of expectation maximisation that raises the log evidence by less has found nothing more.
constexpr double settled_gain = 0.01;
constexpr int most_steps = 1000;
/// The ranges are distinguished long before.
constexpr int steps_to_choose = 12;
/// What the images know less of than a hundredth of what the prior says of a millimetre teaches nothing.
constexpr double least_strength = 0.01;
/// A phase without a tag that is seen, beside the mean phase.
constexpr double least_weight = 1e-12;

/// The phases' information in the splines' common eigenmodes, phases weighed by how much they know: y_i ~ N(0, K + 1 / strength_i) with
/// K = W^1/2 K_time W^1/2.
struct CommonModes {
  Eigen::MatrixXd places;    // V
  Eigen::VectorXd strength;  // of the last of them, which the images know something of
  Eigen::MatrixXd seen;      // theirs, a row each: strength_i y_i
  Eigen::VectorXd weight;    // T: the diagonal of W, 1 in the mean
};

CommonModes common_modes(const Eigen::MatrixXd& place_precision, const std::vector<PhaseInformation>& phases,
                         const Eigen::MatrixXd& estimates) {
  const auto count = place_precision.rows();
  const auto times = static_cast<Eigen::Index>(phases.size());
  CommonModes modes;
  modes.weight.resize(times);
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(count, count);
  Eigen::MatrixXd gradient(count, times);
  for (Eigen::Index k = 0; k < times; ++k) {
    const PhaseInformation& phase = phases[static_cast<size_t>(k)];
    modes.weight[k] = phase.precision.trace();
    mean += phase.precision / static_cast<double>(times);
    gradient.col(k) = phase.vector - phase.precision * estimates.col(k);
  }
  modes.weight /= std::max(modes.weight.mean(), 1e-300);
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> solver(mean, place_precision);
  modes.places = solver.eigenvectors();
  const Eigen::Index known =
      std::max<Eigen::Index>(1, (solver.eigenvalues().array() > least_strength).count());
  modes.strength = solver.eigenvalues().tail(known);
  // Each phase is taken to know the same modes, all of them better or worse; so near the estimate, where what it truly knows is the gradient.
  const Eigen::MatrixXd places = modes.places.rightCols(known);
  const Eigen::VectorXd root = modes.weight.cwiseMax(least_weight).cwiseSqrt();
  modes.seen =
      modes.strength.asDiagonal() * (places.transpose() * place_precision * estimates) * root.asDiagonal();
  modes.seen += places.transpose() * gradient * root.cwiseInverse().asDiagonal();
  return modes;
}

/// K = vectors diag(variances) vectors'.
struct TimeCovariance {
  Eigen::MatrixXd vectors;
  Eigen::VectorXd variances;
  double log_evidence;
};

TimeCovariance decomposed(const Eigen::MatrixXd& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  return {solver.eigenvectors(), solver.eigenvalues().cwiseMax(0.0), 0};
}

/// One step: the expected second moment of the modes, and the evidence of the covariance before.
TimeCovariance expect(const CommonModes& modes, const TimeCovariance& before) {
  const Eigen::ArrayXXd seen = modes.seen * before.vectors;  // n x T
  const Eigen::ArrayXXd gain = (modes.strength * before.variances.transpose()).array() + 1.0;
  const Eigen::ArrayXXd share =
      (1.0 / gain).rowwise() * before.variances.transpose().array();  // posterior variance
  const Eigen::MatrixXd mean = seen * share;
  Eigen::MatrixXd moment = mean.transpose() * mean;
  moment.diagonal() += share.colwise().sum().matrix();
  const double log_evidence = 0.5 * ((seen * mean.array()).sum() - gain.log().sum());
  TimeCovariance next = decomposed(before.vectors * (moment / static_cast<double>(modes.strength.size())) *
                                   before.vectors.transpose());
  next.log_evidence = log_evidence;
  return next;
}

/// The mean of a variance over what its likelihood leaves, any standard deviation as likely as any other (Gelman, Bayesian Anal. 1 (2006)
/// 515). The likeliest value of what is hardly seen is often none at all, and would be stated as certainty. `seen` and
/// `strength`: of each place; `likeliest`: where the likelihood is highest.
double expected_variance(const Eigen::ArrayXd& seen, const Eigen::ArrayXd& strength, double likeliest) {
  const auto log_likelihood = [&](double sigma) {
    const Eigen::ArrayXd gain = 1.0 + strength * (sigma * sigma);
    return 0.5 * (seen.square() * (sigma * sigma) / gain - gain.log()).sum();
  };
  const double top = log_likelihood(std::sqrt(likeliest));
  constexpr double negligible = -12;  // e^-12 of the highest
  double high = std::max(std::sqrt(likeliest), 1e-6);
  while (log_likelihood(high) - top > negligible && high < 1e3)
    high *= 1.5;
  constexpr int steps = 200;
  double sum = 0, squares = 0;
  for (int step = 0; step < steps; ++step) {
    const double sigma = high * (step + 0.5) / steps;
    const double likelihood = std::exp(log_likelihood(sigma) - top);
    sum += likelihood;
    squares += likelihood * sigma * sigma;
  }
  return squares / sum;
}

}  // namespace

MotionPrior learn_motion_prior(const SplinePlane& splines, const std::vector<PhaseInformation>& phases,
                               const Eigen::MatrixXd& estimates, const std::vector<double>& kappas_per_mm) {
  const auto times = static_cast<Eigen::Index>(phases.size());
  MotionPrior best;
  CommonModes modes;
  TimeCovariance covariance;
  double best_evidence = -std::numeric_limits<double>::infinity();
  for (const double kappa : kappas_per_mm) {
    CommonModes tried = common_modes(splines.precision(kappa), phases, estimates);
    // The start: a millimetre of motion, alike over a quarter of the phases.
    TimeCovariance learnt =
        decomposed(Eigen::MatrixXd::NullaryExpr(times, times, [&](Eigen::Index a, Eigen::Index b) {
          const double apart = static_cast<double>(a - b) / static_cast<double>(times);
          return std::sqrt(tried.weight[a] * tried.weight[b]) *
                 (std::exp(-8.0 * apart * apart) + (a == b ? 1e-5 : 0.0));
        }));
    for (int step = 0; step < steps_to_choose; ++step)
      learnt = expect(tried, learnt);
    if (learnt.log_evidence <= best_evidence) continue;
    best_evidence = learnt.log_evidence;
    modes = std::move(tried);
    covariance = std::move(learnt);
    best.kappa_per_mm = kappa;
  }
  for (int step = steps_to_choose; step < most_steps; ++step) {
    const double before = covariance.log_evidence;
    covariance = expect(modes, covariance);
    if (covariance.log_evidence - before < settled_gain) break;
  }
  const Eigen::ArrayXXd seen = modes.seen * covariance.vectors;
  for (Eigen::Index m = 0; m < times; ++m)
    covariance.variances[m] = expected_variance(seen.col(m), modes.strength.array(), covariance.variances[m]);
  best.places = modes.places;
  best.times = modes.weight.cwiseMax(least_weight).cwiseSqrt().cwiseInverse().asDiagonal() *
               covariance.vectors * covariance.variances.cwiseSqrt().asDiagonal();
  return best;
}

}  // namespace diastole::imaging
