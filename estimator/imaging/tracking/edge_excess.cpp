#include "estimator/imaging/tracking/edge_excess.hpp"

#include <algorithm>
#include <cmath>

#include "estimator/imaging/tracking/robust_weight.hpp"

namespace diastole::imaging {
namespace {

struct Shell {
  double squares = 0, count = 0;
  [[nodiscard]] double mean() const { return squares / std::max(count, 1.0); }
};

/// Zero-filling makes next neighbours alike: of so many pixels one is new.
constexpr double pixels_alike = 2.0;

}  // namespace

EdgeExcess::EdgeExcess(const std::vector<TrackedPhase>& phases, double pixel_mm) : shell_mm_(0.5 * pixel_mm) {
  std::vector<Shell> shells;
  double all = 0;
  for (const TrackedPhase& phase : phases) {
    for (Eigen::Index i = 0; i < phase.residual.size(); ++i) {
      if (phase.residual(i) == 0) continue;
      const double off = static_cast<double>(phase.residual(i)) / phase.noise;
      const auto shell =
          static_cast<size_t>(std::max(0.0, static_cast<double>(phase.depth_mm(i)) / shell_mm_));
      if (shell >= shells.size()) shells.resize(shell + 1);
      shells[shell].squares += std::min(off * off, huber_limit * huber_limit);
      shells[shell].count += 1;
      all += 1;
    }
  }
  Shell deep;
  size_t edge = shells.size();
  while (edge > 0 && deep.count < 0.25 * all) {
    --edge;
    deep.squares += shells[edge].squares;
    deep.count += shells[edge].count;
  }
  factors_.resize(edge, 1.0);
  for (size_t i = 0; i < edge; ++i) {
    if (shells[i].count == 0) continue;
    const double excess = shells[i].mean() / std::max(deep.mean(), 1e-300) - 1;
    const double error = std::sqrt(2 * pixels_alike * (1 / shells[i].count + 1 / deep.count));
    factors_[i] += static_cast<double>(phases.size()) * std::max(0.0, excess - 2 * error);
  }
}

double EdgeExcess::at(double depth_mm) const {
  const auto shell = static_cast<size_t>(std::max(0.0, depth_mm / shell_mm_));
  return shell < factors_.size() ? factors_[shell] : 1.0;
}

}  // namespace diastole::imaging
