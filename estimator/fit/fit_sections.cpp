#include "estimator/fit/fit_sections.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "estimator/mesh/local_field.hpp"
#include "estimator/motion_residuals/tag_match.hpp"
#include "estimator/solution/body_section.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

constexpr double cell_mm = 3.0;          // of a cut: lines are straight over it
constexpr double grid_mm = 7.5;          // between a grid's lines, where there are no tags
constexpr double tag_slice_mm = 0.75;    // half thickness in which tag points belong to a cut
constexpr double point_slice_mm = 4.0;   // the same for 3-D points, which are spread over the body
constexpr double in_plane_slack = 1e-3;  // of a unit vector that lies in a plane

struct Cut {
  std::string title;
  std::string horizontal, vertical;
  SectionPlane plane;

  [[nodiscard]] Eigen::Vector3d normal() const { return plane.horizontal.cross(plane.vertical); }
  [[nodiscard]] bool holds(const Eigen::Vector3d& x_mm, double slice_mm) const {
    return std::abs(normal().dot(x_mm - plane.origin_mm)) < slice_mm;
  }
  void add(PlaneCurve& curve, const Eigen::Vector3d& x_mm) const {
    curve.h_mm.push_back(plane.horizontal.dot(x_mm));
    curve.v_mm.push_back(plane.vertical.dot(x_mm));
  }
};

/// In the undeformed material, upright in the cut: normal . X = offset.
struct MaterialPlane {
  Eigen::Vector3d normal;
  double offset_mm;
};

/// The distinct planes of the frame's tags in the cut.
std::vector<MaterialPlane> tag_planes(const Cut& cut, const std::vector<TagPoint>& tags, int frame) {
  const auto rounded = [](double value) { return std::lround(value * 1000); };
  std::map<std::array<long, 4>, MaterialPlane> planes;
  for (const TagPoint& tag : tags) {
    const Eigen::Vector3d normal = vector_of(tag.normal);
    if (tag.frame != frame || !cut.holds(vector_of(tag.x_mm), tag_slice_mm)) continue;
    if (std::abs(cut.normal().dot(normal)) > in_plane_slack) continue;
    planes.try_emplace({rounded(normal[0]), rounded(normal[1]), rounded(normal[2]), rounded(tag.plane_mm)},
                       MaterialPlane{normal, tag.plane_mm});
  }
  std::vector<MaterialPlane> list;
  for (const auto& [key, plane] : planes)
    list.push_back(plane);
  return list;
}

std::vector<MaterialPlane> grid_planes(const Cut& cut, double extent_mm) {
  std::vector<MaterialPlane> list;
  for (double offset_mm = 0.5 * grid_mm; offset_mm < extent_mm; offset_mm += grid_mm)
    for (const Eigen::Vector3d& normal : {cut.plane.horizontal, cut.plane.vertical})
      for (const double side : {-1.0, 1.0})
        list.push_back({normal, side * offset_mm});
  return list;
}

/// Lines of the material, with a gap after each.
PlaneCurve seen(const Cut& cut, const HermiteMesh& mesh, const NodeField& position_mm,
                const std::vector<MaterialLine>& lines) {
  const Eigen::Vector3d gap = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  PlaneCurve curve;
  for (const MaterialLine& line : lines) {
    for (const MaterialPoint& end : line)
      cut.add(curve, mesh.value(position_mm, end));
    cut.add(curve, gap);
  }
  return curve;
}

FitSection section_of(const Cut& cut, const HermiteMesh& mesh, const EstimatedFrame& frame,
                      const Measurement& measurement) {
  const BodySection body = cut_body(mesh, frame.position_mm, cut.plane, cell_mm);
  const auto before = [&](const auto& lines) { return seen(cut, mesh, mesh.reference(), lines); };
  const auto after = [&](const auto& lines) { return seen(cut, mesh, frame.position_mm, lines); };
  FitSection section{
      cut.title, cut.horizontal, cut.vertical, {before(body.outline)}, {after(body.outline)}, {}, {}, {}};
  const std::vector<ElementField> undeformed = element_fields(mesh, mesh.reference());
  const bool has_tags = !measurement.tags.empty();
  for (const MaterialPlane& plane :
       has_tags ? tag_planes(cut, measurement.tags, frame.number) : grid_planes(cut, mesh.extent_mm())) {
    const std::vector<MaterialLine> lines = level_lines(body, [&](const MaterialPoint& point) {
      return plane.normal.dot(local_value(undeformed[point.element], point.xi)) - plane.offset_mm;
    });
    if (lines.empty()) continue;
    section.lines_before.push_back(before(lines));
    section.lines_after.push_back(after(lines));
  }
  for (const TagPoint& tag : measurement.tags) {
    const Eigen::Vector3d x_mm = vector_of(tag.x_mm);
    if (tag.frame == frame.number && cut.holds(x_mm, tag_slice_mm) &&
        std::abs(cut.normal().dot(vector_of(tag.normal))) < in_plane_slack)
      cut.add(section.observed, x_mm);
  }
  for (const ObservedPoint& point : measurement.points) {
    const Eigen::Vector3d x_mm = vector_of(point.x_mm);
    if (point.frame == frame.number && !has_tags && cut.holds(x_mm, point_slice_mm))
      cut.add(section.observed, x_mm);
  }
  return section;
}

/// Height of the tag slice across the axis that is nearest mid-height; 0 without one.
double across_height_mm(const Measurement& measurement, int frame) {
  double best_mm = 0;
  bool found = false;
  for (const TagPoint& tag : measurement.tags) {
    if (tag.frame != frame || std::abs(tag.normal[2]) > in_plane_slack) continue;
    if (!found || std::abs(tag.x_mm[2]) < std::abs(best_mm)) best_mm = tag.x_mm[2];
    found = true;
  }
  return best_mm;
}

/// Direction, across the axis, of the first tag slice along it: its tags' normals lie in the slice. x without
/// one.
Eigen::Vector3d along_direction(const Measurement& measurement, int frame) {
  for (const TagPoint& tag : measurement.tags) {
    const Eigen::Vector3d across(tag.normal[0], tag.normal[1], 0);
    if (tag.frame == frame && std::abs(tag.normal[2]) > in_plane_slack && across.norm() > in_plane_slack) {
      return across[0] < 0 ? -across.normalized() : across.normalized();
    }
  }
  return Eigen::Vector3d::UnitX();
}

Cut cut_across(const Measurement& measurement, int frame) {
  const double height_mm = across_height_mm(measurement, frame);
  return {.title = fmt::format("Across the axis, z = {:.1f} mm", height_mm),
          .horizontal = "x (mm)",
          .vertical = "y (mm)",
          .plane = {{0.0, 0.0, height_mm}, Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY()}};
}

Cut cut_along(const Measurement& measurement, int frame) {
  const Eigen::Vector3d direction = along_direction(measurement, frame);
  const double angle_deg = std::atan2(direction[1], direction[0]) / rad_per_deg;
  return {.title = fmt::format("Along the axis, {:.0f}° from x", angle_deg),
          .horizontal = "distance from the axis (mm)",
          .vertical = "z (mm)",
          .plane = {Eigen::Vector3d::Zero(), direction, Eigen::Vector3d::UnitZ()}};
}

}  // namespace

std::vector<FitSection> draw_sections(const HermiteMesh& mesh, const EstimatedFrame& frame,
                                      const Measurement& measurement) {
  return {section_of(cut_across(measurement, frame.number), mesh, frame, measurement),
          section_of(cut_along(measurement, frame.number), mesh, frame, measurement)};
}

}  // namespace diastole
