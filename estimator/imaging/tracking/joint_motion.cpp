#include "estimator/imaging/tracking/joint_motion.hpp"

#include <cmath>

namespace diastole::imaging {
namespace {

/// A term of which the images know a twentieth of what the prior does stays at none, with the prior's variance: the images would take a twentieth
/// off that, and a fortieth off the standard deviation.
constexpr double least_known = 0.05;

/// The inverse of a lower triangle in its place: halves are inverted by themselves, which needs a third of the work of solving for the
/// identity.
void invert_lower(Eigen::Ref<Eigen::MatrixXd> lower) {
  const Eigen::Index count = lower.rows();
  if (count <= 64) {
    lower =
        Eigen::MatrixXd(lower.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(count, count)));
    return;
  }
  const Eigen::Index half = count / 2;
  const Eigen::Index rest = count - half;
  invert_lower(lower.topLeftCorner(half, half));
  invert_lower(lower.bottomRightCorner(rest, rest));
  const Eigen::MatrixXd right =
      lower.bottomLeftCorner(rest, half) * lower.topLeftCorner(half, half).triangularView<Eigen::Lower>();
  lower.bottomLeftCorner(rest, half).noalias() =
      -(lower.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>() * right);
}

/// Terms of which the images know enough. `seen`: of each phase V' H V.
std::vector<JointCovariance::Term> known_terms(const MotionPrior& prior,
                                               const std::vector<Eigen::MatrixXd>& seen) {
  std::vector<JointCovariance::Term> terms;
  for (Eigen::Index place = 0; place < prior.places.cols(); ++place) {
    for (Eigen::Index time = 0; time < prior.times.cols(); ++time) {
      double known = 0;
      for (size_t k = 0; k < seen.size(); ++k)
        known += std::pow(prior.times(static_cast<Eigen::Index>(k), time), 2) * seen[k](place, place);
      if (known > least_known) terms.push_back({place, time});
    }
  }
  return terms;
}

/// The lower triangle of the terms' precision.
Eigen::MatrixXd precision_of(const std::vector<JointCovariance::Term>& terms, const Eigen::MatrixXd& times,
                             const std::vector<Eigen::MatrixXd>& seen) {
  const Eigen::Index places = seen[0].rows();
  Eigen::MatrixXd pairs(times.rows(), places * places);  // V_i' H V_j, all phases of a pair together
  for (Eigen::Index k = 0; k < times.rows(); ++k)
    pairs.row(k) = seen[static_cast<size_t>(k)].reshaped().transpose();
  const auto unknowns = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd precision = Eigen::MatrixXd::Identity(unknowns, unknowns);
  for (Eigen::Index b = 0; b < unknowns; ++b) {
    const auto [place_b, time_b] = terms[static_cast<size_t>(b)];
    for (Eigen::Index a = b; a < unknowns; ++a) {
      const auto [place_a, time_a] = terms[static_cast<size_t>(a)];
      precision(a, b) += (times.col(time_a).array() * times.col(time_b).array() *
                          pairs.col(place_b * places + place_a).array())
                             .sum();
    }
  }
  return precision;
}

}  // namespace

JointMotion fit_jointly(const MotionPrior& prior, const std::vector<PhaseInformation>& phases,
                        bool with_covariance) {
  const Eigen::Index count = prior.places.rows();
  std::vector<Eigen::MatrixXd> seen;
  Eigen::MatrixXd vectors(count, static_cast<Eigen::Index>(phases.size()));
  for (size_t k = 0; k < phases.size(); ++k) {
    seen.emplace_back(prior.places.transpose() * (phases[k].precision * prior.places));
    vectors.col(static_cast<Eigen::Index>(k)) = prior.places.transpose() * phases[k].vector;
  }
  const std::vector<JointCovariance::Term> terms = known_terms(prior, seen);
  const auto unknowns = static_cast<Eigen::Index>(terms.size());
  const Eigen::MatrixXd precision = precision_of(terms, prior.times, seen);
  const Eigen::MatrixXd in_time = vectors * prior.times;
  Eigen::VectorXd vector(unknowns);
  for (Eigen::Index a = 0; a < unknowns; ++a)
    vector[a] = in_time(terms[static_cast<size_t>(a)].place, terms[static_cast<size_t>(a)].time);
  const Eigen::LLT<Eigen::MatrixXd> factor(precision);  // reads the lower triangle
  const Eigen::VectorXd solution = factor.solve(vector);
  Eigen::MatrixXd amplitudes = Eigen::MatrixXd::Zero(count, prior.times.cols());
  for (Eigen::Index a = 0; a < unknowns; ++a)
    amplitudes(terms[static_cast<size_t>(a)].place, terms[static_cast<size_t>(a)].time) = solution[a];
  JointMotion motion{prior.places * amplitudes * prior.times.transpose(), {}};
  if (!with_covariance) return motion;
  motion.covariance = {prior, terms, factor.matrixL()};
  invert_lower(motion.covariance.inverse_factor);
  return motion;
}

Eigen::MatrixXd JointCovariance::phase_factor(size_t phase) const {
  const auto time = static_cast<Eigen::Index>(phase);
  const Eigen::Index count = prior.places.rows();
  const Eigen::Index unknowns = inverse_factor.rows();
  Eigen::MatrixXd known = Eigen::MatrixXd::Zero(unknowns, count);  // a column a place mode
  Eigen::VectorXd unknown = Eigen::VectorXd::Constant(count, prior.times.row(time).squaredNorm());
  for (Eigen::Index a = 0; a < unknowns; ++a) {
    const Term& term = terms[static_cast<size_t>(a)];
    const double share = prior.times(time, term.time);
    known.col(term.place).tail(unknowns - a) += share * inverse_factor.col(a).tail(unknowns - a);
    unknown[term.place] -= share * share;
  }
  Eigen::MatrixXd factor(unknowns + count, count);
  factor.topRows(unknowns).noalias() = known * prior.places.transpose();
  factor.bottomRows(count) = unknown.cwiseMax(0.0).cwiseSqrt().asDiagonal() * prior.places.transpose();
  return factor;
}

}  // namespace diastole::imaging
