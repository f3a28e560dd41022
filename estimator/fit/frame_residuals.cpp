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

namespace {

/// All fields on one element: a row a field, its coefficients as ElementField holds them.
Eigen::MatrixXd gathered(const HermiteMesh& mesh, size_t element, std::span<const NodeField* const> fields) {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(fields.size()), 3 * hermite_functions);
  for (size_t i = 0; i < fields.size(); ++i) {
    const ElementField field = mesh.gather(element, *fields[i]);
    rows.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(field.data(), field.size());
  }
  return rows;
}

/// direction · field(point) of every field.
Eigen::VectorXd along(const Eigen::MatrixXd& gathered_fields, const Eigen::Vector3d& direction,
                      const Xi& xi) {
  const HermiteBasis basis = hermite_basis(xi);
  ElementField weights;
  for (size_t a = 0; a < hermite_functions; ++a)
    weights.col(static_cast<Eigen::Index>(a)) = basis.value[a] * direction;
  return gathered_fields * Eigen::Map<const Eigen::VectorXd>(weights.data(), weights.size());
}

}  // namespace

Eigen::MatrixXd FrameResiduals::derivatives(std::span<const NodeField* const> fields) const {
  Eigen::MatrixXd jacobian(rows(), static_cast<Eigen::Index>(fields.size()));
  std::vector<Eigen::MatrixXd> by_element(mesh_.element_count());
  parallel_for(by_element.size(), machine_threads(),
               [&](size_t element) { by_element[element] = gathered(mesh_, element, fields); });
  parallel_for(usable_tags_.size(), machine_threads(), [&](size_t i) {
    const TagMatch& match = usable_tags_[i].match;
    jacobian.row(static_cast<Eigen::Index>(i)) =
        along(by_element[match.point.element], match.by_motion, match.point.xi) /
        tags_[usable_tags_[i].index].sigma_mm;
  });
  const auto first = static_cast<Eigen::Index>(usable_tags_.size());
  parallel_for(usable_points_.size(), machine_threads(), [&](size_t i) {
    const auto& [index, point] = usable_points_[i];
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      jacobian.row(first + 3 * static_cast<Eigen::Index>(i) + axis) =
          along(by_element[point.element], -Eigen::Vector3d::Unit(axis), point.xi) / points_[index].sigma_mm;
    }
  });
  return jacobian;
}

}  // namespace diastole
