#include "estimator/motion_residuals/field_rows.hpp"

#include <algorithm>
#include <atomic>
#include <optional>
#include <thread>

#include "estimator/motion_residuals/tag_match.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::explain {
namespace {

size_t machine_threads() { return std::max(1U, std::thread::hardware_concurrency()); }

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

/// Places the row at a match and returns its weighted residual.
double put(FieldRow& row, const HermiteMesh& mesh, const NodeField& seen_mm, const TagMatch& match,
           double sigma_mm) {
  row.point = match.point;
  row.X_mm = mesh.value(mesh.reference(), match.point);
  row.by_motion = match.by_motion / sigma_mm;
  row.by_reference = -mesh.reference_gradient(seen_mm, match.point).transpose() * row.by_motion;
  return match.error_mm / sigma_mm;
}

/// Two fields at a place, and their slopes, from one set of basis values.
struct Local {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Matrix3d slope = Eigen::Matrix3d::Zero();

  Local(const ElementField& field, const HermiteBasis& basis) {
    for (size_t a = 0; a < hermite_functions; ++a) {
      const Eigen::Vector3d coefficient = field.col(static_cast<Eigen::Index>(a));
      value += basis.value[a] * coefficient;
      for (size_t k = 0; k < 3; ++k)
        slope.col(static_cast<Eigen::Index>(k)) += basis.slope[k][a] * coefficient;
    }
  }
};

/// One step of match_tag's Newton method from where the tag was in a similar motion: the error is then right to second
/// order in the change. False if the step is long or leaves the element: the whole search is due.
bool follow_closely(FieldRow& row, const ElementField& reference, const ElementField& seen,
                    const TagPoint& tag, double& weighted) {
  constexpr double close_mm = 1.0;
  constexpr double slack_xi = 0.02;
  const HermiteBasis basis = hermite_basis(row.point.xi);
  const Local undeformed(reference, basis);
  const Local deformed(seen, basis);
  const Eigen::Vector3d normal = vector_of(tag.normal);
  const Eigen::Matrix3d dx_inverse = deformed.slope.inverse();
  const Eigen::Vector3d pulled_normal = (undeformed.slope * dx_inverse).transpose() * normal;
  const double projection = pulled_normal.dot(normal);
  const Eigen::Vector3d miss_mm = vector_of(tag.x_mm) - deformed.value;
  const double error_mm =
      (pulled_normal.dot(miss_mm) - (tag.plane_mm - normal.dot(undeformed.value))) / projection;
  const Eigen::Vector3d xi_change = dx_inverse * (miss_mm - error_mm * normal);
  const Eigen::Vector3d moved_mm = undeformed.slope * xi_change;
  if (!(projection > 0.1) || !(moved_mm.norm() < close_mm)) return false;
  for (size_t k = 0; k < 3; ++k) {
    const double before = row.point.xi[k];
    const double after = before + xi_change[static_cast<Eigen::Index>(k)];
    if (after < std::min(before, -slack_xi) || after > std::max(before, 1.0 + slack_xi)) return false;
    row.point.xi[k] = after;
  }
  row.X_mm = undeformed.value + moved_mm;
  row.by_motion = -pulled_normal / (projection * tag.sigma_mm);
  row.by_reference = -(deformed.slope * undeformed.slope.inverse()).transpose() * row.by_motion;
  weighted = error_mm / tag.sigma_mm;
  return true;
}

}  // namespace

FieldRows::FieldRows(const Measurement& measurement, LocatorOptions locator)
    : tags_(measurement.tags), points_(measurement.points), locator_(locator) {
  for (int frame = 1; frame < static_cast<int>(measurement.frames.size()); ++frame) {
    const auto here = [frame](const auto& point) { return point.frame == frame; };
    if (std::any_of(tags_.begin(), tags_.end(), here) || std::any_of(points_.begin(), points_.end(), here))
      frames_.push_back(frame);
  }
  first_.assign(frames_.size() + 1, 0);
}

void FieldRows::find(const HermiteMesh& mesh, const PointLocator& reference,
                     const std::vector<NodeField>& seen_mm) {
  rows_.clear();
  left_out_ = 0;
  for (size_t slot = 0; slot < frames_.size(); ++slot) {
    first_[slot] = static_cast<Eigen::Index>(rows_.size());
    find_points(slot, mesh, reference, seen_mm[slot]);
  }
  first_.back() = static_cast<Eigen::Index>(rows_.size());
  residuals_.setZero(size());
  if (!follow(mesh, reference, seen_mm)) rows_.clear();
}

void FieldRows::find_points(size_t slot, const HermiteMesh& mesh, const PointLocator& reference,
                            const NodeField& seen_mm) {
  const PointLocator deformed(mesh, seen_mm, locator_);
  std::vector<std::optional<MaterialPoint>> found(tags_.size());
  parallel_for(tags_.size(), machine_threads(), [&](size_t i) {
    if (tags_[i].frame != frames_[slot]) return;
    const auto guess = find_tag(deformed, tags_[i]);
    if (!guess) return;
    if (const auto match = match_tag(mesh, reference, seen_mm, tags_[i], *guess)) found[i] = match->point;
  });
  const Eigen::Vector3d none = Eigen::Vector3d::Zero();
  for (size_t i = 0; i < tags_.size(); ++i) {
    if (tags_[i].frame != frames_[slot]) continue;
    if (found[i]) {
      rows_.push_back({slot, i, 0, *found[i], none, none, none});
    } else {
      ++left_out_;
    }
  }
  for (size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].frame != frames_[slot]) continue;
    if (const auto place = reference.find(vector_of(points_[i].X_mm))) {
      for (const Eigen::Index component : {0, 1, 2})
        rows_.push_back({slot, tags_.size() + i, component, place->point, none, none, none});
    } else {
      ++left_out_;
    }
  }
}

bool FieldRows::follow(const HermiteMesh& mesh, const PointLocator& reference,
                       const std::vector<NodeField>& seen_mm) {
  std::atomic<bool> all_found = true;
  std::vector<FieldRow> moved = rows_;
  Eigen::VectorXd residuals(size());
  std::vector<ElementField> undeformed;
  for (size_t e = 0; e < mesh.element_count(); ++e)
    undeformed.push_back(mesh.gather(e, mesh.reference()));
  std::vector<std::vector<ElementField>> deformed(seen_mm.size());
  for (size_t slot = 0; slot < seen_mm.size(); ++slot)
    for (size_t e = 0; e < mesh.element_count(); ++e)
      deformed[slot].push_back(mesh.gather(e, seen_mm[slot]));
  parallel_for(moved.size(), machine_threads(), [&](size_t i) {
    FieldRow& row = moved[i];
    const NodeField& seen = seen_mm[row.slot];
    const auto at = static_cast<Eigen::Index>(i);
    if (row.source < tags_.size()) {
      const TagPoint& tag = tags_[row.source];
      const size_t e = row.point.element;
      if (follow_closely(row, undeformed[e], deformed[row.slot][e], tag, residuals[at])) return;
      if (const auto match = match_tag(mesh, reference, seen, tag, row.point)) {
        residuals[at] = put(row, mesh, seen, *match, tag.sigma_mm);
      } else {
        all_found = false;
      }
      return;
    }
    const ObservedPoint& point = points_[row.source - tags_.size()];
    const auto place = reference.find(vector_of(point.X_mm), row.point);
    if (!place) {
      all_found = false;
      return;
    }
    const Eigen::Vector3d miss_mm = vector_of(point.x_mm) - mesh.value(seen, place->point);
    residuals[at] =
        put(row, mesh, seen, {place->point, miss_mm[row.component], -Eigen::Vector3d::Unit(row.component)},
            point.sigma_mm);
  });
  if (!all_found) return false;
  rows_ = std::move(moved);
  residuals_ = std::move(residuals);
  return true;
}

FieldRows FieldRows::relocated(const PointLocator& reference) const {
  FieldRows other = *this;
  parallel_for(other.rows_.size(), machine_threads(), [&](size_t i) {
    FieldRow& row = other.rows_[i];
    const auto place = reference.find(row.X_mm);
    if (place) row.point = place->point;
    if (!place)
      row = {row.slot,
             row.source,
             row.component,
             {},
             row.X_mm,
             Eigen::Vector3d::Zero(),
             Eigen::Vector3d::Zero()};
  });
  return other;
}

Eigen::MatrixXd FieldRows::columns(size_t slot, const HermiteMesh& mesh,
                                   std::span<const NodeField* const> motion,
                                   std::span<const NodeField* const> reference) const {
  const auto fields = static_cast<Eigen::Index>(motion.size());
  const auto gathered = [&](size_t element, std::span<const NodeField* const> of) {
    Eigen::MatrixXd block = Eigen::MatrixXd::Zero(fields, 3 * hermite_functions);
    for (size_t i = 0; i < of.size(); ++i) {
      if (of[i] == nullptr) continue;
      const ElementField field = mesh.gather(element, *of[i]);
      block.row(static_cast<Eigen::Index>(i)) =
          Eigen::Map<const Eigen::RowVectorXd>(field.data(), field.size());
    }
    return block;
  };
  std::vector<Eigen::MatrixXd> by_motion(mesh.element_count());
  std::vector<Eigen::MatrixXd> by_reference(mesh.element_count());
  parallel_for(mesh.element_count(), machine_threads(), [&](size_t e) {
    by_motion[e] = gathered(e, motion);
    if (!reference.empty()) by_reference[e] = gathered(e, reference);
  });
  Eigen::MatrixXd result(count(slot), fields);
  parallel_for(static_cast<size_t>(count(slot)), machine_threads(), [&](size_t i) {
    const FieldRow& row = rows_[static_cast<size_t>(first_[slot]) + i];
    const HermiteBasis basis = hermite_basis(row.point.xi);
    const auto weights = [&](const Eigen::Vector3d& direction) {
      ElementField weight;
      for (size_t a = 0; a < hermite_functions; ++a)
        weight.col(static_cast<Eigen::Index>(a)) = basis.value[a] * direction;
      return weight;
    };
    const ElementField on_motion = weights(row.by_motion);
    Eigen::VectorXd sum =
        by_motion[row.point.element] * Eigen::Map<const Eigen::VectorXd>(on_motion.data(), on_motion.size());
    if (!reference.empty()) {
      const ElementField on_reference = weights(row.by_reference);
      sum += by_reference[row.point.element] *
             Eigen::Map<const Eigen::VectorXd>(on_reference.data(), on_reference.size());
    }
    result.row(static_cast<Eigen::Index>(i)) = sum;
  });
  return result;
}

}  // namespace diastole::explain
