#include "estimator/motion_residuals/motion_residuals.hpp"

#include <algorithm>
#include <optional>

#include "estimator/mesh/local_field.hpp"
#include "estimator/motion_residuals/tag_match.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole {
namespace {

constexpr double most_lost = 0.1;

/// How far a point lies beyond its element in the undeformed body.
double outside_mm(const HermiteMesh& mesh, const MaterialPoint& point) {
  MaterialPoint nearest = point;
  for (double& xi : nearest.xi)
    xi = std::clamp(xi, 0.0, 1.0);
  if (nearest.xi == point.xi) return 0;
  return (mesh.value(mesh.reference(), point) - mesh.value(mesh.reference(), nearest)).norm();
}

/// Sets the row to a match and returns its residual.
double put(ResidualRow& row, const TagMatch& match) {
  row.point = match.point;
  row.X_mm = match.X_mm;
  row.by_motion = match.by_motion / row.sigma_mm;
  row.by_reference = match.by_reference / row.sigma_mm;
  return match.error_mm / row.sigma_mm;
}

/// Sets the three rows of a 3-D point to its place on the body and returns their residuals.
Eigen::Vector3d put(std::span<ResidualRow, 3> rows, const ObservedPoint& seen, const MaterialPoint& point,
                    const ElementField& reference, const ElementField& position) {
  const LocalField undeformed = local_field(reference, point.xi);
  const LocalField deformed = local_field(position, point.xi);
  const Eigen::Matrix3d F = deformed.slope * undeformed.slope.inverse();
  for (ResidualRow& row : rows) {
    row.point = point;
    row.X_mm = undeformed.value;
    row.by_motion = -Eigen::Vector3d::Unit(row.component) / row.sigma_mm;
    row.by_reference = F.row(row.component).transpose() / row.sigma_mm;
  }
  return (vector_of(seen.x_mm) - deformed.value) / rows[0].sigma_mm;
}

void put_lost(ResidualRow& row) {
  row.was_lost = true;
  row.by_motion.setZero();
  row.by_reference.setZero();
}

/// One step of match_tag's Newton method from where the tag was; its residual. None if the step is long or leaves the
/// element: the whole search is due.
std::optional<double> follow_closely(ResidualRow& row, const ElementField& reference,
                                     const ElementField& position, const TagPoint& tag) {
  constexpr double close_mm = 1.0;
  constexpr double slack_xi = 0.02;
  const LocalField undeformed = local_field(reference, row.point.xi);
  const LocalField deformed = local_field(position, row.point.xi);
  const Eigen::Vector3d normal = vector_of(tag.normal);
  const Eigen::Matrix3d dx_inverse = deformed.slope.inverse();
  const Eigen::Vector3d pulled_normal = (undeformed.slope * dx_inverse).transpose() * normal;
  const double projection = pulled_normal.dot(normal);
  const Eigen::Vector3d miss_mm = vector_of(tag.x_mm) - deformed.value;
  const double error_mm =
      (pulled_normal.dot(miss_mm) - (tag.plane_mm - normal.dot(undeformed.value))) / projection;
  const Eigen::Vector3d xi_change = dx_inverse * (miss_mm - error_mm * normal);
  const Eigen::Vector3d moved_mm = undeformed.slope * xi_change;
  if (!(projection > 0.1) || !(moved_mm.norm() < close_mm)) return {};
  Xi after = row.point.xi;
  for (size_t k = 0; k < 3; ++k) {
    const double before = after[k];
    after[k] += xi_change[static_cast<Eigen::Index>(k)];
    if (after[k] < std::min(before, -slack_xi) || after[k] > std::max(before, 1.0 + slack_xi)) return {};
  }
  row.point.xi = after;
  row.X_mm = undeformed.value + moved_mm;
  row.by_motion = -pulled_normal / (projection * row.sigma_mm);
  row.by_reference = normal / (projection * row.sigma_mm);
  return error_mm / row.sigma_mm;
}

/// All fields on one element: a row a field (zeros for none), its coefficients as ElementField holds them.
Eigen::MatrixXd gathered(const HermiteMesh& mesh, size_t element, std::span<const NodeField* const> fields) {
  Eigen::MatrixXd rows =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(fields.size()), 3 * hermite_functions);
  for (size_t i = 0; i < fields.size(); ++i) {
    if (fields[i] == nullptr) continue;
    const ElementField field = mesh.gather(element, *fields[i]);
    rows.row(static_cast<Eigen::Index>(i)) = Eigen::Map<const Eigen::RowVectorXd>(field.data(), field.size());
  }
  return rows;
}

/// direction . field of every gathered field.
Eigen::VectorXd along(const Eigen::MatrixXd& gathered_fields, const Eigen::Vector3d& direction,
                      const std::array<double, hermite_functions>& basis) {
  ElementField weights;
  for (size_t a = 0; a < hermite_functions; ++a)
    weights.col(static_cast<Eigen::Index>(a)) = basis[a] * direction;
  return gathered_fields * Eigen::Map<const Eigen::VectorXd>(weights.data(), weights.size());
}

}  // namespace

std::vector<int> loaded_frames(const Measurement& measurement) {
  std::vector<int> frames;
  for (int frame = 1; frame < static_cast<int>(measurement.frames.size()); ++frame) {
    const auto here = [frame](const auto& point) { return point.frame == frame; };
    if (std::ranges::any_of(measurement.tags, here) || std::ranges::any_of(measurement.points, here))
      frames.push_back(frame);
  }
  return frames;
}

MotionResiduals::MotionResiduals(const Measurement& measurement, std::vector<int> frames,
                                 LocatorOptions locator)
    : frames_(std::move(frames)),
      tags_(measurement.tags),
      points_(measurement.points),
      locator_(locator),
      given_up_(tags_.size(), false),
      first_(frames_.size() + 1, 0) {
  for (const TagPoint& tag : tags_)
    planes_mm_.push_back(tag.plane_mm);
}

MotionResiduals MotionResiduals::joined(const std::vector<const MotionResiduals*>& parts) {
  MotionResiduals all = *parts.front();
  for (size_t i = 1; i < parts.size(); ++i) {
    const MotionResiduals& part = *parts[i];
    const size_t slots = all.frames_.size();
    const Eigen::Index begun = all.size();
    all.frames_.insert(all.frames_.end(), part.frames_.begin(), part.frames_.end());
    for (ResidualRow row : part.rows_) {
      row.slot += slots;
      all.rows_.push_back(row);
    }
    for (size_t slot = 1; slot < part.first_.size(); ++slot)
      all.first_.push_back(begun + part.first_[slot]);
    all.residuals_.conservativeResize(begun + part.size());
    all.residuals_.tail(part.size()) = part.residuals_;
    all.found_.usable += part.found_.usable;
    all.found_.tags_left_out += part.found_.tags_left_out;
    all.found_.tags_unfollowed += part.found_.tags_unfollowed;
    all.found_.points_left_out += part.found_.points_left_out;
  }
  return all;
}

void MotionResiduals::shift_planes(const Eigen::VectorXd& by_mm) {
  for (size_t i = 0; i < tags_.size(); ++i)
    tags_[i].plane_mm = planes_mm_[i] + by_mm[static_cast<Eigen::Index>(i)];
}

double MotionResiduals::by_plane(const ResidualRow& row) const {
  // The plane's material moves by dc along n, and the residual by by_reference . n dc less: by_reference is parallel to n.
  return -row.by_reference.dot(vector_of(tags_[row.source].normal));
}

size_t MotionResiduals::find(const HermiteMesh& mesh, const PointLocator& reference,
                             std::span<const NodeField> position_mm) {
  std::vector<bool> was_usable(tags_.size() + points_.size(), false);
  for (const ResidualRow& row : rows_)
    was_usable[row.source] = true;
  rows_.clear();
  found_ = {};
  for (size_t slot = 0; slot < frames_.size(); ++slot) {
    find_tags(slot, mesh, reference, position_mm[slot]);
    find_points(slot, mesh, reference, position_mm[slot]);
    first_[slot + 1] = static_cast<Eigen::Index>(rows_.size());
  }
  residuals_.resize(size());
  std::ranges::transform(rows_, residuals_.begin(), &ResidualRow::found_residual);
  return static_cast<size_t>(std::ranges::count_if(
      rows_, [&](const ResidualRow& row) { return of_tag(row) && !was_usable[row.source]; }));
}

void MotionResiduals::find_tags(size_t slot, const HermiteMesh& mesh, const PointLocator& reference,
                                const NodeField& position_mm) {
  const PointLocator deformed(mesh, position_mm, locator_);
  std::vector<std::optional<TagMatch>> matches(tags_.size());
  std::vector<unsigned char> on_body(tags_.size(), 0);
  parallel_for(tags_.size(), machine_threads(), [&](size_t i) {
    if (tags_[i].frame != frames_[slot]) return;
    const auto guess = find_tag(deformed, tags_[i]);
    if (!guess || (!given_up_[i] && outside_mm(mesh, *guess) > farthest_outside_mm)) return;
    on_body[i] = 1;
    if (!given_up_[i]) matches[i] = match_tag(reference, deformed.elements(), tags_[i], *guess);
  });
  for (size_t i = 0; i < tags_.size(); ++i) {
    if (tags_[i].frame != frames_[slot]) continue;
    ++(matches[i] ? found_.usable : found_.tags_left_out);
    if (!matches[i]) {
      found_.tags_unfollowed += on_body[i];
      continue;
    }
    ResidualRow& row =
        rows_.emplace_back(ResidualRow{.slot = slot, .source = i, .sigma_mm = tags_[i].sigma_mm});
    row.found_residual = put(row, *matches[i]);
    row.found_point = row.point;
  }
}

void MotionResiduals::find_points(size_t slot, const HermiteMesh& mesh, const PointLocator& reference,
                                  const NodeField& position_mm) {
  const std::vector<ElementField> deformed = element_fields(mesh, position_mm);
  for (size_t i = 0; i < points_.size(); ++i) {
    if (points_[i].frame != frames_[slot]) continue;
    const auto place = reference.find(vector_of(points_[i].X_mm));
    ++(place ? found_.usable : found_.points_left_out);
    if (!place) continue;
    const size_t e = place->point.element;
    const size_t first = rows_.size();
    for (Eigen::Index component = 0; component < 3; ++component)
      rows_.push_back({.slot = slot,
                       .source = tags_.size() + i,
                       .component = component,
                       .sigma_mm = points_[i].sigma_mm});
    const std::span<ResidualRow, 3> rows(&rows_[first], 3);
    const Eigen::Vector3d residuals =
        put(rows, points_[i], place->point, reference.elements()[e], deformed[e]);
    for (ResidualRow& row : rows)
      row.found_residual = residuals[row.component];
  }
}

bool MotionResiduals::follow(const HermiteMesh& mesh, const PointLocator& reference,
                             std::span<const NodeField> position_mm, Following how) {
  std::vector<ResidualRow> moved = rows_;
  std::vector<unsigned char> lost(rows_.size(), 0);
  Eigen::VectorXd residuals(size());
  std::vector<std::vector<ElementField>> deformed;  // of each slot
  for (size_t slot = 0; slot < frames_.size(); ++slot)
    deformed.push_back(element_fields(mesh, position_mm[slot]));
  const auto follow_tag = [&](ResidualRow& row) {
    const std::span<const ElementField> position = deformed[row.slot];
    const TagPoint& tag = tags_[row.source];
    const size_t e = row.point.element;
    std::optional<double> residual;
    const bool closely = how == Following::closely;
    if (closely) residual = follow_closely(row, reference.elements()[e], position[e], tag);
    const MaterialPoint& guess = closely ? row.point : row.found_point;
    const auto match = residual ? std::nullopt : match_tag(reference, position, tag, guess);
    if (match) residual = put(row, *match);
    return residual;
  };
  const auto follow_point = [&](std::span<ResidualRow, 3> rows) {
    const ObservedPoint& seen = points_[rows[0].source - tags_.size()];
    const auto place = reference.find(vector_of(seen.X_mm), rows[0].point);
    if (!place) return std::optional<Eigen::Vector3d>();
    const size_t e = place->point.element;
    return std::optional(put(rows, seen, place->point, reference.elements()[e], deformed[rows[0].slot][e]));
  };
  parallel_for(moved.size(), machine_threads(), [&](size_t i) {
    const auto at = static_cast<Eigen::Index>(i);
    ResidualRow& row = moved[i];
    if (of_tag(row)) {
      const std::optional<double> residual = follow_tag(row);
      lost[i] = !residual;
      residuals[at] = residual.value_or(row.found_residual);
      if (lost[i] != 0) put_lost(row);
    } else if (row.component == 0) {  // its two other components follow
      const auto three = follow_point(std::span<ResidualRow, 3>(&row, 3));
      for (size_t k = 0; k < 3; ++k) {
        lost[i + k] = !three;
        residuals[at + static_cast<Eigen::Index>(k)] =
            three ? (*three)[static_cast<Eigen::Index>(k)] : moved[i + k].found_residual;
        if (!three) put_lost(moved[i + k]);
      }
    }
  });
  if (!few_are(lost)) return false;
  rows_ = std::move(moved);
  residuals_ = std::move(residuals);
  return true;
}

bool MotionResiduals::few_are(const std::vector<unsigned char>& lost) const {
  struct Share {
    double lost = 0.0;
    double all = 0.0;
  };
  std::vector<std::array<Share, 2>> shares(frames_.size());
  for (size_t i = 0; i < rows_.size(); ++i) {
    Share& share = shares[rows_[i].slot][of_tag(rows_[i]) ? 0 : 1];
    share.lost += lost[i];
    share.all += 1.0;
  }
  return std::ranges::all_of(shares, [](const auto& slot) {
    return std::ranges::all_of(slot, [](const Share& s) { return s.lost <= most_lost * s.all; });
  });
}

size_t MotionResiduals::give_up_lost() {
  size_t count = 0;
  for (const ResidualRow& row : rows_) {
    if (!row.was_lost || !of_tag(row)) continue;
    given_up_[row.source] = true;
    ++count;
  }
  return count;
}

Eigen::VectorXd MotionResiduals::sigmas_mm() const {
  Eigen::VectorXd result(size());
  for (size_t i = 0; i < rows_.size(); ++i)
    result[static_cast<Eigen::Index>(i)] = rows_[i].sigma_mm;
  return result;
}

MotionResiduals MotionResiduals::relocated(const PointLocator& reference) const {
  MotionResiduals other = *this;
  parallel_for(other.rows_.size(), machine_threads(), [&](size_t i) {
    ResidualRow& row = other.rows_[i];
    if (const auto place = reference.find(row.X_mm)) {
      row.point = place->point;
      return;
    }
    row.point = {};
    row.by_motion.setZero();
    row.by_reference.setZero();
  });
  return other;
}

Eigen::MatrixXd MotionResiduals::columns(size_t slot, const HermiteMesh& mesh,
                                         std::span<const NodeField* const> motion,
                                         std::span<const NodeField* const> reference) const {
  std::vector<Eigen::MatrixXd> by_motion(mesh.element_count());
  std::vector<Eigen::MatrixXd> by_reference(mesh.element_count());
  parallel_for(mesh.element_count(), machine_threads(), [&](size_t e) {
    by_motion[e] = gathered(mesh, e, motion);
    if (!reference.empty()) by_reference[e] = gathered(mesh, e, reference);
  });
  Eigen::MatrixXd result(count(slot), static_cast<Eigen::Index>(motion.size()));
  parallel_for(static_cast<size_t>(count(slot)), machine_threads(), [&](size_t i) {
    const ResidualRow& row = rows_[static_cast<size_t>(first_[slot]) + i];
    const std::array<double, hermite_functions> basis = hermite_basis_values(row.point.xi);
    Eigen::VectorXd sum = along(by_motion[row.point.element], row.by_motion, basis);
    if (!reference.empty()) sum += along(by_reference[row.point.element], row.by_reference, basis);
    result.row(static_cast<Eigen::Index>(i)) = sum;
  });
  return result;
}

std::vector<const NodeField*> pointers_to(std::span<const NodeField> fields) {
  std::vector<const NodeField*> pointers;
  for (const NodeField& field : fields)
    pointers.push_back(&field);
  return pointers;
}

Eigen::MatrixXd MotionResiduals::columns(const HermiteMesh& mesh, std::span<const NodeField> motion,
                                         std::span<const double> factors) const {
  const std::vector<const NodeField*> fields = pointers_to(motion);
  Eigen::MatrixXd result(size(), static_cast<Eigen::Index>(fields.size()));
  for (size_t slot = 0; slot < frames_.size(); ++slot)
    result.middleRows(first(slot), count(slot)) = factors[slot] * columns(slot, mesh, fields);
  return result;
}

}  // namespace diastole
