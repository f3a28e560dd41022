#include "estimator/fit/frame_residuals.hpp"

#include <atomic>
#include <thread>

#include "estimator/fe/parallel_for.hpp"

namespace diastole {
namespace {

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

size_t machine_threads() { return std::max(1U, std::thread::hardware_concurrency()); }

}  // namespace

FrameResiduals::FrameResiduals(const HermiteMesh& mesh, const PointLocator& reference,
                               std::vector<TagPoint> tags, std::vector<ObservedPoint> points)
    : mesh_(mesh), reference_(reference), tags_(std::move(tags)), points_(std::move(points)) {
  for (size_t i = 0; i < points_.size(); ++i) {
    if (const auto found = reference_.find(vector_of(points_[i].X_mm)))
      usable_points_.push_back({i, found->point});
  }
}

std::vector<FrameResiduals::UsableTag> FrameResiduals::find_tags(std::span<const double> position_mm,
                                                                 const LocatorOptions& options) {
  const PointLocator deformed(mesh_, position_mm, options);
  std::vector<std::optional<TagMatch>> matches(tags_.size());
  parallel_for(tags_.size(), machine_threads(), [&](size_t i) {
    const auto guess = find_tag(deformed, tags_[i]);
    if (guess) matches[i] = match_tag(mesh_, reference_, position_mm, tags_[i], *guess);
  });
  std::vector<UsableTag> found;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (matches[i]) found.push_back({i, *matches[i]});
  }
  return found;
}

size_t FrameResiduals::find_points(std::span<const double> position_mm, const LocatorOptions& options) {
  std::vector<bool> was_usable(tags_.size(), false);
  for (const UsableTag& tag : usable_tags_)
    was_usable[tag.index] = true;
  usable_tags_ = find_tags(position_mm, options);
  size_t gained = 0;
  for (const UsableTag& tag : usable_tags_)
    gained += was_usable[tag.index] ? 0 : 1;
  const auto rows = static_cast<Eigen::Index>(usable_tags_.size() + 3 * usable_points_.size());
  weighted_.setZero(rows);
  unweighted_mm_.setZero(rows);
  return gained;
}

bool FrameResiduals::evaluate(std::span<const double> position_mm) {
  std::atomic<bool> all_found = true;
  std::vector<TagMatch> matches(usable_tags_.size());
  parallel_for(usable_tags_.size(), machine_threads(), [&](size_t row) {
    const UsableTag& tag = usable_tags_[row];
    const auto match = match_tag(mesh_, reference_, position_mm, tags_[tag.index], tag.match.point);
    if (match) {
      matches[row] = *match;
    } else {
      all_found = false;
    }
  });
  if (!all_found) return false;
  Eigen::Index row = 0;
  for (size_t i = 0; i < usable_tags_.size(); ++i, ++row) {
    usable_tags_[i].match = matches[i];
    unweighted_mm_[row] = matches[i].error_mm;
    weighted_[row] = matches[i].error_mm / tags_[usable_tags_[i].index].sigma_mm;
  }
  for (const UsablePoint& usable : usable_points_) {
    const ObservedPoint& seen = points_[usable.index];
    const Eigen::Vector3d miss_mm = vector_of(seen.x_mm) - mesh_.value(position_mm, usable.point);
    unweighted_mm_.segment<3>(row) = miss_mm;
    weighted_.segment<3>(row) = miss_mm / seen.sigma_mm;
    row += 3;
  }
  return true;
}

Eigen::MatrixXd FrameResiduals::derivatives(std::span<const NodeField* const> fields) const {
  const auto columns = static_cast<Eigen::Index>(fields.size());
  const auto column_field = [&](Eigen::Index column) -> const NodeField& {
    return *fields[static_cast<size_t>(column)];
  };
  Eigen::MatrixXd jacobian(rows(), columns);
  parallel_for(usable_tags_.size(), machine_threads(), [&](size_t i) {
    const UsableTag& tag = usable_tags_[i];
    const Eigen::Vector3d weight = tag.match.by_motion / tags_[tag.index].sigma_mm;
    for (Eigen::Index column = 0; column < columns; ++column) {
      jacobian(static_cast<Eigen::Index>(i), column) =
          weight.dot(mesh_.value(column_field(column), tag.match.point));
    }
  });
  const auto first = static_cast<Eigen::Index>(usable_tags_.size());
  parallel_for(usable_points_.size(), machine_threads(), [&](size_t i) {
    const UsablePoint& usable = usable_points_[i];
    const double sigma_mm = points_[usable.index].sigma_mm;
    for (Eigen::Index column = 0; column < columns; ++column) {
      jacobian.block<3, 1>(first + 3 * static_cast<Eigen::Index>(i), column) =
          -mesh_.value(column_field(column), usable.point) / sigma_mm;
    }
  });
  return jacobian;
}

}  // namespace diastole
