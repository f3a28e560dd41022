#include "estimator/motion_residuals/frame_residuals.hpp"

#include <algorithm>
#include <thread>

#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

constexpr double most_lost = 0.1;  // of a frame's usable tags, in a motion that is not too far off

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// How far a point lies beyond its element in the undeformed body.
double outside_mm(const HermiteMesh& mesh, const MaterialPoint& point) {
  MaterialPoint nearest = point;
  for (double& xi : nearest.xi)
    xi = std::clamp(xi, 0.0, 1.0);
  if (nearest.xi == point.xi) return 0;
  return (mesh.value(mesh.reference(), point) - mesh.value(mesh.reference(), nearest)).norm();
}

size_t machine_threads() { return std::max(1U, std::thread::hardware_concurrency()); }

}  // namespace

FrameResiduals::FrameResiduals(const HermiteMesh& mesh, const PointLocator& reference,
                               std::vector<TagPoint> tags, std::vector<ObservedPoint> points)
    : mesh_(mesh),
      reference_(reference),
      tags_(std::move(tags)),
      points_(std::move(points)),
      given_up_(tags_.size(), false) {
  for (size_t i = 0; i < points_.size(); ++i) {
    if (const auto found = reference_.find(vector_of(points_[i].X_mm)))
      usable_points_.push_back({i, found->point});
  }
}

std::vector<FrameResiduals::UsableTag> FrameResiduals::find_tags(std::span<const double> position_mm,
                                                                 const LocatorOptions& options) {
  const PointLocator deformed(mesh_, position_mm, options);
  std::vector<std::optional<MaterialPoint>> guesses(tags_.size());
  std::vector<std::optional<TagMatch>> matches(tags_.size());
  parallel_for(tags_.size(), machine_threads(), [&](size_t i) {
    guesses[i] = find_tag(deformed, tags_[i]);
    if (!guesses[i] || given_up_[i]) return;
    if (outside_mm(mesh_, *guesses[i]) > farthest_outside_mm) {
      guesses[i].reset();
    } else {
      matches[i] = match_tag(mesh_, reference_, position_mm, tags_[i], *guesses[i]);
    }
  });
  std::vector<UsableTag> found;
  unfollowed_ = 0;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (matches[i]) {
      found.push_back({i, *matches[i], matches[i]->error_mm});
    } else if (guesses[i]) {
      ++unfollowed_;
    }
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
  std::vector<std::optional<TagMatch>> matches(usable_tags_.size());
  parallel_for(usable_tags_.size(), machine_threads(), [&](size_t row) {
    const UsableTag& tag = usable_tags_[row];
    matches[row] = match_tag(mesh_, reference_, position_mm, tags_[tag.index], tag.match.point);
  });
  const auto lost = std::count(matches.begin(), matches.end(), std::nullopt);
  if (static_cast<double>(lost) > most_lost * static_cast<double>(usable_tags_.size())) return false;
  Eigen::Index row = 0;
  for (size_t i = 0; i < usable_tags_.size(); ++i, ++row) {
    UsableTag& tag = usable_tags_[i];
    if (matches[i]) {
      tag.match = *matches[i];
    } else {
      tag.was_lost = true;
      tag.match.error_mm = tag.found_error_mm;
      tag.match.by_motion.setZero();
    }
    unweighted_mm_[row] = tag.match.error_mm;
    weighted_[row] = tag.match.error_mm / tags_[tag.index].sigma_mm;
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

size_t FrameResiduals::give_up_lost() {
  size_t count = 0;
  for (const UsableTag& tag : usable_tags_) {
    if (!tag.was_lost) continue;
    given_up_[tag.index] = true;
    ++count;
  }
  return count;
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
