#include "estimator/reconstruction/field_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "estimator/solution/body_section.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

constexpr double cells_across = 40;
constexpr size_t neighbours = 40;  // whose residuals make a place's

FlatPoints flat(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane,
                const std::vector<MaterialPoint>& points) {
  FlatPoints result;
  for (const MaterialPoint& point : points) {
    const Vector3d place_mm = mesh.value(position_mm, point);
    result.push_back(plane.horizontal.dot(place_mm));
    result.push_back(plane.vertical.dot(place_mm));
  }
  return result;
}

std::vector<MaterialPoint> ends_of(const std::vector<MaterialLine>& lines) {
  std::vector<MaterialPoint> points;
  for (const MaterialLine& line : lines)
    points.insert(points.end(), line.begin(), line.end());
  return points;
}

/// Measured numbers with their undeformed places, for looking up what lies near.
class ResidualMap {
 public:
  ResidualMap(const HermiteMesh& mesh, const FrameField& field) {
    for (const FieldRow& row : field.rows) {
      places_.push_back(mesh.value(mesh.reference(), row.point));
      squares_.push_back(std::min(row.residual * row.residual, 100.0));
    }
  }

  /// Root mean square of the nearest rows' residuals / sigma; a wild one counts as ten.
  [[nodiscard]] double rms_near(const Vector3d& place_mm) const {
    std::vector<std::pair<double, double>> near;
    near.reserve(places_.size());
    for (size_t i = 0; i < places_.size(); ++i)
      near.emplace_back((places_[i] - place_mm).squaredNorm(), squares_[i]);
    const size_t count = std::min(neighbours, near.size());
    if (count == 0) return 0.0;
    std::nth_element(near.begin(), near.begin() + static_cast<std::ptrdiff_t>(count - 1), near.end());
    double sum = 0.0;
    for (size_t i = 0; i < count; ++i)
      sum += near[i].second;
    return std::sqrt(sum / static_cast<double>(count));
  }

 private:
  std::vector<Vector3d> places_;
  std::vector<double> squares_;
};

SolutionSection section_of(const HermiteMesh& mesh, const FrameField& field, const Coverage& coverage,
                           const ResidualMap& residuals, const SectionPlane& plane) {
  const BodySection cut = cut_body(mesh, plane, mesh.extent_mm() / cells_across);
  SolutionSection section;
  NamedField displacement{"displacement_mm", {}}, se{"se_mm", {}}, unseen{"unseen", {}},
      residual{"residual_rms", {}}, volume{"volume_ratio", {}};
  for (const SectionCell& cell : cut.cells) {
    std::vector<MaterialPoint> around;
    for (const Xi& corner : cell.corners)
      around.push_back({cell.element, corner});
    section.cells_before.push_back(flat(mesh, mesh.reference(), plane, around));
    section.cells_after.push_back(flat(mesh, field.position_mm, plane, around));
    const MaterialPoint centre = cell.centre();
    const ElementCoverage& element = coverage.elements[cell.element];
    displacement.values.push_back(mesh.value(field.displacement_mm, centre).norm());
    se.values.push_back(between_probes(element.probe_se_mm, centre.xi));
    unseen.values.push_back(between_probes(element.probe_unseen, centre.xi));
    residual.values.push_back(residuals.rms_near(mesh.value(mesh.reference(), centre)));
    volume.values.push_back(mesh.reference_gradient(field.position_mm, centre).determinant());
  }
  section.outline_before = flat(mesh, mesh.reference(), plane, ends_of(cut.outline));
  section.outline_after = flat(mesh, field.position_mm, plane, ends_of(cut.outline));
  section.elements_before = flat(mesh, mesh.reference(), plane, ends_of(cut.elements));
  section.elements_after = flat(mesh, field.position_mm, plane, ends_of(cut.elements));
  section.fields = {displacement, se, unseen, residual, volume};
  return section;
}

double middle_height_mm(const HermiteMesh& mesh) {
  double low = mesh.reference()[dof_of(0, 0, 2)], high = low;
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    low = std::min(low, mesh.reference()[dof_of(node, 0, 2)]);
    high = std::max(high, mesh.reference()[dof_of(node, 0, 2)]);
  }
  return 0.5 * (low + high);
}

}  // namespace

std::vector<SolutionSection> field_sections(const HermiteMesh& mesh, const FrameField& field,
                                            const Coverage& coverage) {
  const ResidualMap residuals(mesh, field);
  const double height_mm = middle_height_mm(mesh);
  const Vector3d centre_mm(0.0, 0.0, height_mm);
  SolutionSection across =
      section_of(mesh, field, coverage, residuals, {centre_mm, Vector3d::UnitX(), Vector3d::UnitY()});
  across.title = fmt::format("Short axis, material of z = {:.4g} mm", height_mm);
  across.horizontal = "x (mm)";
  across.vertical = "y (mm)";
  SolutionSection along =
      section_of(mesh, field, coverage, residuals, {centre_mm, Vector3d::UnitX(), Vector3d::UnitZ()});
  along.title = "Long axis, material of y = 0";
  along.horizontal = "x (mm)";
  along.vertical = "z (mm)";
  return {std::move(across), std::move(along)};
}

}  // namespace diastole
