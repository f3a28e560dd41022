#include "estimator/rig/boundary_layer.hpp"

#include <array>
#include <cmath>

namespace diastole::rig {
namespace {

struct Term {
  double decay, weight;
};
constexpr std::array terms{Term{26.3744, 1.0},     Term{72.8033, 1.16725}, Term{187.424, 2.20064},
                           Term{536.626, 3.92861}, Term{1570.60, 6.78788}, Term{4618.13, 11.6761},
                           Term{13601.1, 20.0612}, Term{40082.5, 34.4541}, Term{118153.0, 59.1642},
                           Term{348316.0, 101.590}};

/// Weight over decay of all terms beyond the last: both go on by the same factors.
double beyond_the_last() {
  const auto part = [](const Term& term) { return term.weight / term.decay; };
  const double last = part(terms.back());
  const double factor = last / part(terms[terms.size() - 2]);
  return last * factor / (1.0 - factor);
}

}  // namespace

BoundaryLayer::BoundaryLayer(const Hose& hose, double step_s)
    : scale_(hose.zielke * 16.0 * hose.viscosity_Pa_s / std::pow(hose.bore_mm * 1e-3, 2) * 1e-3),
      step_s_(step_s) {
  const double spreading =
      4.0 * hose.viscosity_Pa_s / (hose.density_kg_m3 * std::pow(hose.bore_mm * 1e-3, 2));
  inertia_ = scale_ * beyond_the_last() / spreading;
  for (int k = 0; k < remembered; ++k) {
    const Term& term = terms[static_cast<size_t>(k)];
    const double decays = term.decay * spreading * step_s;
    kept_[k] = std::exp(-decays);
    gained_[k] = term.weight * -std::expm1(-decays) / decays;
  }
  for (size_t k = remembered; k < terms.size(); ++k)
    inertia_ += scale_ * terms[k].weight / (terms[k].decay * spreading);
  all_gained_ = gained_.sum();
}

void BoundaryLayer::pass(double speed_m_s, double forgetting) {
  const double left = left_halfway(forgetting);
  memory_ = left * (left * kept_ * memory_ + (speed_m_s - speed_) * gained_);
  speed_ = speed_m_s;
}

double BoundaryLayer::drag_after(double speed_m_s, double forgetting) const {
  const double left = left_halfway(forgetting);
  return scale_ * left * (left * (kept_ * memory_).sum() + all_gained_ * (speed_m_s - speed_));
}

}  // namespace diastole::rig
