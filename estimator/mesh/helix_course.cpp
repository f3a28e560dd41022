#include "estimator/mesh/helix_course.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

namespace diastole {

void HelixCourse::add(double depth, const Eigen::Matrix3d& tensor) {
  const auto bin = static_cast<size_t>(std::clamp(depth * depths, 0.0, depths - 1.0));
  sums_[bin] += tensor;
  counts_[bin] += 1;
}

size_t HelixCourse::count() const {
  return static_cast<size_t>(std::accumulate(counts_.begin(), counts_.end(), 0.0));
}

std::array<double, HelixCourse::depths> HelixCourse::angles_rad() const {
  std::array<double, depths> angles{};
  std::optional<double> last;
  size_t first = depths;
  for (size_t bin = 0; bin < depths; ++bin) {
    if (counts_[bin] > 0) {
      const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(mean(bin));
      const Eigen::Vector3d f = eigen.eigenvectors().col(2);
      const double angle = std::atan2(f.y(), f.x());
      last = last ? *last + std::remainder(angle - *last, std::numbers::pi) : angle;
      first = std::min(first, bin);
    }
    angles[bin] = last.value_or(0);
  }
  for (size_t bin = 0; bin < first && first < depths; ++bin)
    angles[bin] = angles[first];
  const double middle = angles[depths / 2];
  const double shift = std::remainder(middle, std::numbers::pi) - middle;
  for (double& angle : angles)
    angle += shift;
  return angles;
}

double angle_at(const std::array<double, HelixCourse::depths>& angles_rad, double depth) {
  const double place = depth * HelixCourse::depths - 0.5;
  const auto low = static_cast<size_t>(std::clamp(std::floor(place), 0.0, HelixCourse::depths - 2.0));
  return std::lerp(angles_rad[low], angles_rad[low + 1], place - static_cast<double>(low));
}

}  // namespace diastole
