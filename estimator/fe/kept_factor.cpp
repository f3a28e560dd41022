#include "estimator/fe/kept_factor.hpp"

#include <utility>

namespace diastole {
namespace {

constexpr double most_contraction_near = 0.9;
constexpr double most_contraction_far = 0.2;
constexpr double far_step = 1.0;
constexpr size_t most_steps = 20;

}  // namespace

KeptFactor::KeptFactor(Product product, std::vector<double> first_step) : product_(std::move(product)) {
  squares_.push_back(product_(first_step, first_step));
  steps_.push_back(std::move(first_step));
}

std::optional<std::vector<double>> KeptFactor::next_step(std::vector<double> simplified) {
  if (steps_.size() > most_steps) return {};
  for (size_t i = 0; i + 1 < steps_.size(); ++i) {
    const double share = product_(simplified, steps_[i]) / squares_[i];
    for (size_t n = 0; n < simplified.size(); ++n)
      simplified[n] += share * steps_[i + 1][n];
  }
  const double square = product_(simplified, simplified);
  const double most = squares_.front() > far_step * far_step ? most_contraction_far : most_contraction_near;
  if (!(square <= most * most * squares_.back())) return {};
  const double grown = 1.0 / (1.0 - product_(simplified, steps_.back()) / squares_.back());
  for (double& value : simplified)
    value *= grown;
  squares_.push_back(grown * grown * square);
  steps_.push_back(simplified);
  return simplified;
}

}  // namespace diastole
