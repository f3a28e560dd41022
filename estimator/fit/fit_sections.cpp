#include "estimator/fit/fit_sections.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <tuple>

#include "estimator/motion_residuals/tag_match.hpp"

namespace diastole {
namespace {

constexpr double step_mm = 1.5;          // between samples of a line
constexpr double tag_slice_mm = 0.75;    // half thickness in which tag points belong to a cut
constexpr double point_slice_mm = 4.0;   // the same for 3-D points, which are spread over the body
constexpr double in_plane_slack = 1e-3;  // of a unit vector that lies in a plane
constexpr int arcs = 120;

struct Cut {
  std::string title;
  std::string horizontal, vertical;
  Eigen::Vector3d h, v, normal;
  double offset_mm;

  [[nodiscard]] Eigen::Vector3d place(double h_mm, double v_mm) const {
    return h_mm * h + v_mm * v + offset_mm * normal;
  }
  [[nodiscard]] bool holds(const Eigen::Vector3d& x_mm, double slice_mm) const {
    return std::abs(normal.dot(x_mm) - offset_mm) < slice_mm;
  }
};

class Drawer {
 public:
  Drawer(const AnnulusSpecimen& annulus, const HermiteMesh& mesh, const NodeField& position_mm, Cut cut)
      : annulus_(annulus),
        mesh_(mesh),
        position_mm_(position_mm),
        reference_(mesh, mesh.reference()),
        cut_(std::move(cut)) {}

  /// Adds a curve of the undeformed cut to `before`, and to `after` the material that lies there in the
  /// deformed cut: it is followed off the plane as far as the motion through the plane demands.
  void add(const PlaneCurve& curve, std::vector<PlaneCurve>& before, std::vector<PlaneCurve>& after) const {
    PlaneCurve carried;
    for (size_t i = 0; i < curve.h_mm.size(); ++i) {
      Eigen::Vector3d X_mm = cut_.place(curve.h_mm[i], curve.v_mm[i]);
      std::optional<Eigen::Vector3d> x_mm;
      for (int round = 0; round < 3; ++round) {
        const auto found = reference_.find(X_mm);
        if (!found) break;
        x_mm = mesh_.value(position_mm_, found->point);
        X_mm -= (cut_.normal.dot(*x_mm) - cut_.offset_mm) * cut_.normal;
      }
      if (!x_mm) continue;
      carried.h_mm.push_back(cut_.h.dot(*x_mm));
      carried.v_mm.push_back(cut_.v.dot(*x_mm));
    }
    before.push_back(curve);
    after.push_back(std::move(carried));
  }

  /// The parts of a straight line (through `from`, along `along`) of the cut that lie in the undeformed body.
  [[nodiscard]] std::vector<PlaneCurve> clipped(const Eigen::Vector2d& from,
                                                const Eigen::Vector2d& along) const {
    const double reach_mm = std::hypot(annulus_.outer_radius_mm, annulus_.height_mm);
    std::vector<PlaneCurve> parts;
    bool was_inside = false;
    for (double t = -reach_mm; t <= reach_mm; t += step_mm) {
      const Eigen::Vector2d at = from + t * along;
      const bool is_inside = inside(cut_.place(at[0], at[1]));
      if (is_inside) {
        if (!was_inside) parts.emplace_back();
        parts.back().h_mm.push_back(at[0]);
        parts.back().v_mm.push_back(at[1]);
      }
      was_inside = is_inside;
    }
    std::erase_if(parts, [](const PlaneCurve& part) { return part.h_mm.size() < 2; });
    return parts;
  }

  [[nodiscard]] const Cut& cut() const { return cut_; }

 private:
  [[nodiscard]] bool inside(const Eigen::Vector3d& X_mm) const {
    const double radius_mm = std::hypot(X_mm[0], X_mm[1]);
    return radius_mm >= annulus_.inner_radius_mm && radius_mm <= annulus_.outer_radius_mm &&
           std::abs(X_mm[2]) <= annulus_.height_mm / 2;
  }

  const AnnulusSpecimen& annulus_;
  const HermiteMesh& mesh_;
  const NodeField& position_mm_;
  PointLocator reference_;
  Cut cut_;
};

PlaneCurve circle(double radius_mm) {
  PlaneCurve curve;
  for (int i = 0; i <= arcs; ++i) {
    const double angle = 2 * M_PI * i / arcs;
    curve.h_mm.push_back(radius_mm * std::cos(angle));
    curve.v_mm.push_back(radius_mm * std::sin(angle));
  }
  return curve;
}

PlaneCurve straight(Eigen::Vector2d from, Eigen::Vector2d to) {
  PlaneCurve curve;
  const int pieces = std::max(1, static_cast<int>((to - from).norm() / step_mm));
  for (int i = 0; i <= pieces; ++i) {
    const Eigen::Vector2d at = from + (to - from) * i / pieces;
    curve.h_mm.push_back(at[0]);
    curve.v_mm.push_back(at[1]);
  }
  return curve;
}

/// The four sides of the wall's rectangle at h > 0 (side = 1) or h < 0 (side = -1).
std::vector<PlaneCurve> wall(const AnnulusSpecimen& annulus, double side) {
  const double a = side * annulus.inner_radius_mm, b = side * annulus.outer_radius_mm,
               z = annulus.height_mm / 2;
  return {straight({a, -z}, {a, z}), straight({b, -z}, {b, z}), straight({a, -z}, {b, -z}),
          straight({a, z}, {b, z})};
}

std::vector<PlaneCurve> grid_across(const AnnulusSpecimen& annulus) {
  constexpr int rings = 4, spokes = 24;
  std::vector<PlaneCurve> lines;
  const double wall_mm = annulus.outer_radius_mm - annulus.inner_radius_mm;
  for (int i = 1; i < rings; ++i)
    lines.push_back(circle(annulus.inner_radius_mm + wall_mm * i / rings));
  for (int i = 0; i < spokes; ++i) {
    const Eigen::Vector2d along(std::cos(2 * M_PI * i / spokes), std::sin(2 * M_PI * i / spokes));
    lines.push_back(straight(annulus.inner_radius_mm * along, annulus.outer_radius_mm * along));
  }
  return lines;
}

std::vector<PlaneCurve> grid_along(const AnnulusSpecimen& annulus) {
  constexpr int columns = 4, rows = 10;
  std::vector<PlaneCurve> lines;
  const double wall_mm = annulus.outer_radius_mm - annulus.inner_radius_mm, z_mm = annulus.height_mm / 2;
  for (const double side : {-1.0, 1.0}) {
    for (int i = 1; i < columns; ++i) {
      const double h_mm = side * (annulus.inner_radius_mm + wall_mm * i / columns);
      lines.push_back(straight({h_mm, -z_mm}, {h_mm, z_mm}));
    }
    for (int i = 1; i < rows; ++i) {
      const double v_mm = -z_mm + 2 * z_mm * i / rows;
      lines.push_back(
          straight({side * annulus.inner_radius_mm, v_mm}, {side * annulus.outer_radius_mm, v_mm}));
    }
  }
  return lines;
}

/// The distinct tag planes of the frame's points in the cut, as lines of the undeformed cut.
std::vector<PlaneCurve> tag_lines(const Drawer& drawer, const std::vector<TagPoint>& tags, int frame) {
  const Cut& cut = drawer.cut();
  const auto rounded = [](double value) { return std::lround(value * 1000); };
  std::map<std::tuple<long, long, long, long>, const TagPoint*> planes;
  for (const TagPoint& tag : tags) {
    if (tag.frame != frame || !cut.holds(vector_of(tag.x_mm), tag_slice_mm)) continue;
    if (std::abs(cut.normal.dot(vector_of(tag.normal))) > in_plane_slack) continue;
    planes.try_emplace(
        {rounded(tag.normal[0]), rounded(tag.normal[1]), rounded(tag.normal[2]), rounded(tag.plane_mm)},
        &tag);
  }
  std::vector<PlaneCurve> lines;
  for (const auto& [key, tag] : planes) {
    const Eigen::Vector3d normal = vector_of(tag->normal);
    const Eigen::Vector2d in_plane(cut.h.dot(normal), cut.v.dot(normal));
    const Eigen::Vector2d along(-in_plane[1], in_plane[0]);
    for (PlaneCurve& part : drawer.clipped(tag->plane_mm * in_plane, along))
      lines.push_back(std::move(part));
  }
  return lines;
}

void add_observed(PlaneCurve& observed, const Cut& cut, const std::array<double, 3>& x_mm, double slice_mm) {
  const Eigen::Vector3d x = vector_of(x_mm);
  if (!cut.holds(x, slice_mm)) return;
  observed.h_mm.push_back(cut.h.dot(x));
  observed.v_mm.push_back(cut.v.dot(x));
}

FitSection section_of(const Drawer& drawer, const std::vector<PlaneCurve>& outline,
                      const std::vector<PlaneCurve>& grid, int frame, const Measurement& measurement) {
  const Cut& cut = drawer.cut();
  FitSection section;
  section.title = cut.title;
  section.horizontal = cut.horizontal;
  section.vertical = cut.vertical;
  for (const PlaneCurve& curve : outline)
    drawer.add(curve, section.outline_before, section.outline_after);
  const bool has_tags = !measurement.tags.empty();
  for (const PlaneCurve& line : has_tags ? tag_lines(drawer, measurement.tags, frame) : grid) {
    drawer.add(line, section.lines_before, section.lines_after);
  }
  for (const TagPoint& tag : measurement.tags) {
    if (tag.frame == frame && std::abs(cut.normal.dot(vector_of(tag.normal))) < in_plane_slack) {
      add_observed(section.observed, cut, tag.x_mm, tag_slice_mm);
    }
  }
  for (const ObservedPoint& point : measurement.points) {
    if (point.frame == frame && !has_tags) add_observed(section.observed, cut, point.x_mm, point_slice_mm);
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
          .h = Eigen::Vector3d::UnitX(),
          .v = Eigen::Vector3d::UnitY(),
          .normal = Eigen::Vector3d::UnitZ(),
          .offset_mm = height_mm};
}

Cut cut_along(const Measurement& measurement, int frame) {
  const Eigen::Vector3d direction = along_direction(measurement, frame);
  const double angle_deg = std::atan2(direction[1], direction[0]) * 180 / M_PI;
  return {.title = fmt::format("Along the axis, {:.0f}° from x", angle_deg),
          .horizontal = "distance from the axis (mm)",
          .vertical = "z (mm)",
          .h = direction,
          .v = Eigen::Vector3d::UnitZ(),
          .normal = Eigen::Vector3d::UnitZ().cross(direction),
          .offset_mm = 0};
}

}  // namespace

std::vector<FitSection> draw_sections(const AnnulusSpecimen& annulus, const HermiteMesh& mesh,
                                      const EstimatedFrame& frame, const Measurement& measurement) {
  const Drawer across(annulus, mesh, frame.position_mm, cut_across(measurement, frame.number));
  const Drawer along(annulus, mesh, frame.position_mm, cut_along(measurement, frame.number));
  const std::vector<PlaneCurve> rims = {circle(annulus.inner_radius_mm), circle(annulus.outer_radius_mm)};
  std::vector<PlaneCurve> walls = wall(annulus, 1);
  for (PlaneCurve& curve : wall(annulus, -1))
    walls.push_back(std::move(curve));
  return {section_of(across, rims, grid_across(annulus), frame.number, measurement),
          section_of(along, walls, grid_along(annulus), frame.number, measurement)};
}

}  // namespace diastole
