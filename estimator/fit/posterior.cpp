#include "estimator/fit/posterior.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace diastole {
namespace {

constexpr double wanted_acceptance = 0.7;
constexpr double least_beta = 0.02;

class Chain {
 public:
  Chain(JointProblem& problem, const Eigen::VectorXd& best, const Eigen::MatrixXd& covariance, unsigned seed)
      : problem_(problem), best_(best), generator_(seed) {
    for (Eigen::Index i = 0; i < best.size(); ++i) {
      if (covariance(i, i) > 0 && std::isfinite(covariance(i, i))) free_.push_back(i);
    }
    factor_.compute(covariance(free_, free_));
    start_apart();
  }

  /// One step; whether it was accepted.
  bool step(double beta) {
    const Eigen::VectorXd trial = std::sqrt(1 - beta * beta) * at_ + beta * draw();
    const double trial_phi = phi(trial);
    if (!(std::log(std::uniform_real_distribution<double>(0, 1)(generator_)) < phi_ - trial_phi))
      return false;
    at_ = trial;
    phi_ = trial_phi;
    return true;
  }

  /// All unknowns.
  [[nodiscard]] Eigen::VectorXd q() const { return q_of(at_); }

 private:
  Eigen::VectorXd draw() {
    std::normal_distribution<double> normal;
    Eigen::VectorXd unit(static_cast<Eigen::Index>(free_.size()));
    for (double& value : unit)
      value = normal(generator_);
    return factor_.matrixL() * unit;
  }

  void start_apart() {
    constexpr int most_tries = 20;
    for (double spread = 1.5; at_.size() == 0 || !std::isfinite(phi_); spread *= 0.8) {
      at_ = spread * draw();
      phi_ = phi(at_);
      if (spread < std::pow(0.8, most_tries)) break;
    }
  }

  [[nodiscard]] Eigen::VectorXd q_of(const Eigen::VectorXd& away) const {
    Eigen::VectorXd q = best_;
    q(free_) += away;
    return q;
  }

  double phi(const Eigen::VectorXd& away) {
    constexpr double never = std::numeric_limits<double>::infinity();
    const Eigen::VectorXd q = q_of(away);
    const inference::ParameterSpace& space = problem_.space();
    if (space.clamped(q) != q) return never;
    const std::optional<Eigen::VectorXd> residuals = problem_.residuals(q);
    if (!residuals) return never;
    return 0.5 * residuals->squaredNorm() - 0.5 * away.dot(factor_.solve(away));
  }

  JointProblem& problem_;
  const Eigen::VectorXd& best_;
  std::mt19937_64 generator_;
  std::vector<Eigen::Index> free_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::VectorXd at_;  // the free unknowns, away from the estimate
  double phi_ = std::numeric_limits<double>::infinity();
};

double mean_variance(const std::vector<Eigen::VectorXd>& chains) {
  double sum = 0;
  for (const Eigen::VectorXd& chain : chains)
    sum += (chain.array() - chain.mean()).square().sum() / static_cast<double>(chain.size() - 1);
  return sum / static_cast<double>(chains.size());
}

/// Variance of all draws together, overestimated while the chains disagree.
double pooled_variance(const std::vector<Eigen::VectorXd>& chains) {
  const auto length = static_cast<double>(chains.front().size());
  Eigen::VectorXd means(static_cast<Eigen::Index>(chains.size()));
  for (size_t i = 0; i < chains.size(); ++i)
    means[static_cast<Eigen::Index>(i)] = chains[i].mean();
  const double between = chains.size() > 1 ? (means.array() - means.mean()).square().sum() /
                                                 (static_cast<double>(chains.size()) - 1)
                                           : 0.0;
  return (length - 1) / length * mean_variance(chains) + between;
}

}  // namespace

PosteriorSample sample_posterior(JointProblem& problem, const Eigen::VectorXd& best,
                                 const Eigen::MatrixXd& covariance, const PosteriorOptions& options) {
  PosteriorSample sample;
  const int before = problem.forward_solves();
  const int all = options.chains * (options.steps + options.warm_up);
  int done = 0;
  long accepted = 0;
  double beta = 0.7;
  for (int number = 0; number < options.chains; ++number) {
    Chain chain(problem, best, covariance, options.seed + static_cast<unsigned>(number));
    Eigen::MatrixXd draws(options.steps, best.size());
    for (int step = -options.warm_up; step < options.steps; ++step) {
      if (options.interrupted && options.interrupted()) {
        sample.interrupted = true;
        return sample;
      }
      const bool moved = chain.step(beta);
      if (step >= 0) {
        accepted += moved ? 1 : 0;
        draws.row(step) = chain.q();
      } else {
        // Robbins-Monro on the acceptance, ever smaller.
        const double gain = 1.0 / (3.0 + 0.2 * (step + options.warm_up));
        beta = std::clamp(beta * std::exp(gain * ((moved ? 1.0 : 0.0) - wanted_acceptance)), least_beta, 1.0);
      }
      if (options.on_step) options.on_step(++done, all);
    }
    sample.chains.push_back(std::move(draws));
  }
  sample.accepted = static_cast<double>(accepted) / (static_cast<double>(options.chains) * options.steps);
  sample.solutions = problem.forward_solves() - before;
  return sample;
}

double split_r_hat(const std::vector<Eigen::VectorXd>& chains) {
  std::vector<Eigen::VectorXd> halves;
  for (const Eigen::VectorXd& chain : chains) {
    halves.emplace_back(chain.head(chain.size() / 2));
    halves.emplace_back(chain.tail(chain.size() / 2));
  }
  const double within = mean_variance(halves);
  return within > 0 ? std::sqrt(pooled_variance(halves) / within) : 1.0;
}

double effective_sample_size(const std::vector<Eigen::VectorXd>& chains) {
  const Eigen::Index length = chains.front().size();
  const double variance = pooled_variance(chains),
               draws = static_cast<double>(chains.size()) * static_cast<double>(length);
  if (!(variance > 0)) return draws;
  const double within = mean_variance(chains);
  const auto correlation = [&](Eigen::Index lag) {
    double covariance = 0;
    for (const Eigen::VectorXd& chain : chains) {
      const Eigen::ArrayXd centred = chain.array() - chain.mean();
      covariance +=
          (centred.head(length - lag) * centred.tail(length - lag)).sum() / static_cast<double>(length);
    }
    return 1 - (within - covariance / static_cast<double>(chains.size())) / variance;
  };
  // Geyer's initial positive sequence: pairs of lags while their sum is positive.
  double sum = 0;
  for (Eigen::Index lag = 1; lag + 1 < length; lag += 2) {
    const double pair = correlation(lag) + correlation(lag + 1);
    if (pair < 0) break;
    sum += pair;
  }
  return std::min(draws, draws / (1 + 2 * sum));
}

}  // namespace diastole
