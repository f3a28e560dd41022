#include "estimator/motion_residuals/tag_planes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "estimator/motion_residuals/tag_match.hpp"

namespace diastole {
namespace {

/// Maps a set's values to -1 ... 1; a set without extent to 0.
struct Range {
  double low = 1e300, high = -1e300;

  void take(double value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  [[nodiscard]] double share(double value) const {
    return high > low ? (2 * value - low - high) / (high - low) : 0.0;
  }
};

/// Along the stripes in the image: where the points reach farthest at a right angle to the normal.
Eigen::Vector3d along_stripes(const Measurement& measurement, const std::vector<size_t>& tags,
                              const Eigen::Vector3d& normal) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const size_t i : tags)
    mean += vector_of(measurement.tags[i].x_mm) / static_cast<double>(tags.size());
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - normal * normal.transpose();
  Eigen::Matrix3d moment = Eigen::Matrix3d::Zero();
  for (const size_t i : tags) {
    const Eigen::Vector3d from_mean = across * (vector_of(measurement.tags[i].x_mm) - mean);
    moment += from_mean * from_mean.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(moment).eigenvectors().col(2);
}

}  // namespace

TagPlanes::TagPlanes(const Measurement& measurement) {
  if (!measurement.planes_as_seen) return;
  std::map<std::array<double, 3>, std::vector<size_t>> sets;
  for (size_t i = 0; i < measurement.tags.size(); ++i)
    sets[measurement.tags[i].normal].push_back(i);
  set_of_.resize(measurement.tags.size());
  by_.resize(measurement.tags.size());
  for (const auto& set : sets) {
    const std::vector<size_t>& tags = set.second;
    const Eigen::Vector3d along = along_stripes(measurement, tags, vector_of(set.first));
    Range planes, ends;
    for (const size_t i : tags) {
      planes.take(measurement.tags[i].plane_mm);
      ends.take(along.dot(vector_of(measurement.tags[i].x_mm)));
    }
    for (const size_t i : tags) {
      const TagPoint& tag = measurement.tags[i];
      set_of_[i] = sets_;
      by_[i] = {1.0, planes.share(tag.plane_mm), ends.share(along.dot(vector_of(tag.x_mm)))};
    }
    ++sets_;
  }
}

std::string TagPlanes::name(Eigen::Index unknown) {
  constexpr std::array words{"shift", "spread", "turn"};
  return fmt::format("tags[{}] {}", unknown / of_a_set, words[static_cast<size_t>(unknown % of_a_set)]);
}

int TagPlanes::patch(size_t tag) const {
  constexpr int parts = 4;
  const auto part = [](double share) {
    return std::clamp(static_cast<int>(parts * (share + 1) / 2), 0, parts - 1);
  };
  return (static_cast<int>(set_of_[tag]) * parts + part(by_[tag][1])) * parts + part(by_[tag][2]);
}

Eigen::VectorXd TagPlanes::shifts_mm(const Eigen::VectorXd& coefficients) const {
  Eigen::VectorXd shifts(static_cast<Eigen::Index>(by_.size()));
  for (size_t i = 0; i < by_.size(); ++i)
    shifts[static_cast<Eigen::Index>(i)] = by_[i].dot(coefficients.segment<of_a_set>(first_unknown(i)));
  return shifts;
}

}  // namespace diastole
