#include "estimator/solution/body_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "estimator/mesh/face_map.hpp"
#include "estimator/mesh/local_field.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

constexpr double most_bricks = 32;  // of an element along one direction

/// So many along each direction, however thin an element is: a wall of one element is not of one colour.
double least_bricks(const HermiteMesh& mesh) {
  constexpr double coarse_mesh = 6.0;
  constexpr double bricks_in_all = 40000.0;
  return std::clamp(std::floor(std::cbrt(bricks_in_all / static_cast<double>(mesh.element_count()))), 1.0,
                    coarse_mesh);
}

std::array<size_t, 3> bricks_of(const HermiteMesh& mesh, size_t element, double cell_mm) {
  std::array<double, 3> length_mm{};
  for (size_t sample = 0; sample < 27; ++sample) {
    const auto place = [](size_t digit) { return 0.5 * static_cast<double>(digit); };
    const Eigen::Matrix3d tangents = mesh.xi_gradient(
        mesh.reference(), {element, {place(sample % 3), place(sample / 3 % 3), place(sample / 9)}});
    for (size_t k = 0; k < 3; ++k)
      length_mm[k] = std::max(length_mm[k], tangents.col(static_cast<Eigen::Index>(k)).norm());
  }
  std::array<size_t, 3> bricks{};
  for (size_t k = 0; k < 3; ++k)
    bricks[k] =
        static_cast<size_t>(std::clamp(std::ceil(length_mm[k] / cell_mm), least_bricks(mesh), most_bricks));
  return bricks;
}

/// Where a function that is linear from `start` to `end` changes its sign.
std::optional<Xi> zero_between(const Xi& start, double low, const Xi& end, double high) {
  if ((low < 0.0) == (high < 0.0)) return {};
  Xi xi{};
  for (size_t k = 0; k < 3; ++k)  // exact where they agree: whether xi lies on a face is asked later
    xi[k] = start[k] == end[k] ? start[k] : std::lerp(start[k], end[k], low / (low - high));
  return xi;
}

/// One element's grid of bricks with the signed distances of its corners from the plane.
class BrickGrid {
 public:
  BrickGrid(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane, size_t element,
            double cell_mm)
      : mesh_(mesh),
        position_mm_(position_mm),
        plane_(plane),
        element_(element),
        bricks_(bricks_of(mesh, element, cell_mm)) {
    const Eigen::Vector3d normal = plane.horizontal.cross(plane.vertical);
    const ElementField position = mesh.gather(element, position_mm);
    for (size_t i3 = 0; i3 <= bricks_[2]; ++i3) {
      for (size_t i2 = 0; i2 <= bricks_[1]; ++i2) {
        for (size_t i1 = 0; i1 <= bricks_[0]; ++i1) {
          const Eigen::Vector3d place_mm = local_value(position, xi_at({i1, i2, i3}));
          distance_mm_.push_back(normal.dot(place_mm - plane.origin_mm));
        }
      }
    }
  }

  [[nodiscard]] const std::array<size_t, 3>& bricks() const { return bricks_; }

  /// The polygon in which the plane cuts a brick; empty if it does not.
  [[nodiscard]] std::vector<Xi> cut(const std::array<size_t, 3>& brick) const {
    std::vector<Xi> corners_xi;
    for (size_t corner = 0; corner < 8; ++corner) {
      for (size_t k = 0; k < 3; ++k) {
        const size_t other = corner | (size_t{1} << k);
        if (other == corner) continue;
        const std::array<size_t, 3> from = at(brick, corner), to = at(brick, other);
        if (const auto xi = zero_between(xi_at(from), distance_at(from), xi_at(to), distance_at(to)))
          corners_xi.push_back(*xi);
      }
    }
    if (corners_xi.size() < 3) return {};
    sort_around(corners_xi);
    return corners_xi;
  }

 private:
  static std::array<size_t, 3> at(std::array<size_t, 3> brick, size_t corner) {
    for (size_t k = 0; k < 3; ++k)
      brick[k] += (corner >> k) & 1;
    return brick;
  }
  [[nodiscard]] Xi xi_at(const std::array<size_t, 3>& i) const {
    Xi xi{};
    for (size_t k = 0; k < 3; ++k)
      xi[k] = static_cast<double>(i[k]) / static_cast<double>(bricks_[k]);
    return xi;
  }
  [[nodiscard]] double distance_at(const std::array<size_t, 3>& i) const {
    return distance_mm_[i[0] + (bricks_[0] + 1) * (i[1] + (bricks_[1] + 1) * i[2])];
  }
  void sort_around(std::vector<Xi>& corners_xi) const {
    std::vector<std::pair<double, Xi>> around;
    std::vector<Eigen::Vector2d> flat;
    Eigen::Vector2d centre = Eigen::Vector2d::Zero();
    for (const Xi& xi : corners_xi) {
      const Eigen::Vector3d place_mm = mesh_.value(position_mm_, {element_, xi}) - plane_.origin_mm;
      flat.emplace_back(plane_.horizontal.dot(place_mm), plane_.vertical.dot(place_mm));
      centre += flat.back() / static_cast<double>(corners_xi.size());
    }
    for (size_t i = 0; i < flat.size(); ++i)
      around.emplace_back(std::atan2(flat[i][1] - centre[1], flat[i][0] - centre[0]), corners_xi[i]);
    std::sort(around.begin(), around.end());
    for (size_t i = 0; i < flat.size(); ++i)
      corners_xi[i] = around[i].second;
  }

  const HermiteMesh& mesh_;
  const NodeField& position_mm_;
  const SectionPlane& plane_;
  size_t element_;
  std::array<size_t, 3> bricks_;
  std::vector<double> distance_mm_;
};

/// The cell's edges that lie on faces of its element join the outline or the lines between elements.
void add_lines(const SectionCell& cell, const FaceMap& faces, BodySection& section) {
  for (size_t i = 0; i < cell.corners.size(); ++i) {
    const Xi& from = cell.corners[i];
    const Xi& to = cell.corners[(i + 1) % cell.corners.size()];
    for (size_t k = 0; k < 3; ++k) {
      for (size_t side = 0; side < 2; ++side) {
        const double end = static_cast<double>(side);
        if (from[k] != end || to[k] != end) continue;
        const MaterialLine line{{{cell.element, from}, {cell.element, to}}};
        (faces.is_outer({cell.element, k, side}) ? section.outline : section.elements).push_back(line);
      }
    }
  }
}

constexpr size_t steps = 400;  // over twice the body's extent: no wall is thinner than a step in practice
constexpr int halvings = 40;   // of a step, to find a face
constexpr double inside_xi = 1e-6;  // how far beyond a face still counts as on it

/// Between a place outside and one inside the body: the last one inside.
double find_face(double outside, double inside, const auto& lies_inside) {
  for (int i = 0; i < halvings; ++i) {
    const double middle = 0.5 * (outside + inside);
    (lies_inside(middle) ? inside : outside) = middle;
  }
  return inside;
}

constexpr double cells_across = 40;  // the body, in a section

FlatPoints flat(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane,
                const std::vector<MaterialPoint>& points) {
  FlatPoints result;
  for (const MaterialPoint& point : points) {
    const Eigen::Vector3d place_mm = mesh.value(position_mm, point);
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

}  // namespace

MaterialPoint SectionCell::centre() const {
  Xi mean{};
  for (const Xi& corner : corners) {
    for (size_t k = 0; k < 3; ++k)
      mean[k] += corner[k] / static_cast<double>(corners.size());
  }
  return {element, mean};
}

BodySection cut_body(const HermiteMesh& mesh, const NodeField& position_mm, const SectionPlane& plane,
                     double cell_mm) {
  // Off any face that lies in the plane up to rounding, so that one side's elements are cut as a whole.
  SectionPlane shifted = plane;
  shifted.origin_mm -= 1e-6 * mesh.extent_mm() * plane.horizontal.cross(plane.vertical);
  const FaceMap faces(mesh);
  BodySection section;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const BrickGrid grid(mesh, position_mm, shifted, e, cell_mm);
    const auto [n1, n2, n3] = grid.bricks();
    for (size_t brick = 0; brick < n1 * n2 * n3; ++brick) {
      SectionCell cell{e, grid.cut({brick % n1, brick / n1 % n2, brick / (n1 * n2)})};
      if (cell.corners.empty()) continue;
      add_lines(cell, faces, section);
      section.cells.push_back(std::move(cell));
    }
  }
  return section;
}

std::vector<MaterialLine> level_lines(const BodySection& section,
                                      const std::function<double(const MaterialPoint&)>& function) {
  std::vector<MaterialLine> lines;
  for (const SectionCell& cell : section.cells) {
    std::vector<MaterialPoint> ends;
    Xi before = cell.corners.back();
    double value_before = function({cell.element, before});
    for (const Xi& corner : cell.corners) {
      const double value = function({cell.element, corner});
      if (const auto xi = zero_between(before, value_before, corner, value))
        ends.push_back({cell.element, *xi});
      before = corner;
      value_before = value;
    }
    if (ends.size() == 2) lines.push_back({ends[0], ends[1]});
  }
  return lines;
}

WallProfile cross_wall(const HermiteMesh& mesh, const Eigen::Vector3d& from_mm,
                       const Eigen::Vector3d& direction, size_t count) {
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = inside_xi, .tolerance_mm = 1e-10});
  const Eigen::Vector3d unit = direction.normalized();
  const auto found = [&](double s) { return locator.find(from_mm + s * unit); };
  const auto lies_inside = [&](double s) { return found(s).has_value(); };
  const double step = 2.0 * mesh.extent_mm() / static_cast<double>(steps);
  std::optional<double> first;
  std::optional<double> last;
  for (size_t i = 0; i <= steps; ++i) {
    const double s = static_cast<double>(i) * step;
    if (lies_inside(s)) {
      if (!first) first = s;
      last = s;
    } else if (first) {
      break;
    }
  }
  WallProfile profile;
  if (!first) return profile;
  const double begin = *first == 0.0 ? 0.0 : find_face(*first - step, *first, lies_inside);
  const double end = find_face(*last + step, *last, lies_inside);
  for (size_t i = 0; i < count; ++i) {
    const double depth_mm = (end - begin) * static_cast<double>(i) / static_cast<double>(count - 1);
    const std::optional<LocatedPoint> located = found(begin + depth_mm);
    if (!located) continue;  // a hairline between two elements
    profile.depth_mm.push_back(depth_mm);
    profile.points.push_back(located->point);
  }
  return profile;
}

Eigen::Vector3d middle_of(const HermiteMesh& mesh) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  const auto cover = [&](size_t node) {
    low = std::min(low, mesh.reference()[dof_of(node, 0, 2)]);
    high = std::max(high, mesh.reference()[dof_of(node, 0, 2)]);
  };
  for (const ElementFace& face : mesh.faces().inner) {
    for (const size_t corner : face_corners(face))
      cover(mesh.element(face.element)[corner]);
  }
  if (mesh.faces().inner.empty()) {
    for (size_t node = 0; node < mesh.node_count(); ++node)
      cover(node);
  }
  return {0.0, 0.0, 0.5 * (low + high)};
}

std::string height_words(const Eigen::Vector3d& place_mm) {
  return fmt::format("z = {}{:.4g} mm", place_mm[2] < 0 ? "\u2212" : "", std::abs(place_mm[2]));
}

std::vector<SolutionSection> drawn_sections(
    const HermiteMesh& mesh, const NodeField& position_mm,
    const std::function<std::vector<NamedField>(const std::vector<MaterialPoint>&)>& fields_at) {
  using Eigen::Vector3d;
  const Vector3d centre_mm = middle_of(mesh);
  const auto drawn = [&](std::string title, const Vector3d& up, const char* vertical) {
    const SectionPlane plane{centre_mm, Vector3d::UnitX(), up};
    const BodySection cut = cut_body(mesh, mesh.reference(), plane, mesh.extent_mm() / cells_across);
    const auto before = [&](const auto& points) { return flat(mesh, mesh.reference(), plane, points); };
    const auto after = [&](const auto& points) { return flat(mesh, position_mm, plane, points); };
    SolutionSection section;
    section.title = std::move(title);
    section.horizontal = "x (mm)";
    section.vertical = vertical;
    std::vector<MaterialPoint> centres;
    for (const SectionCell& cell : cut.cells) {
      std::vector<MaterialPoint> around;
      for (const Xi& corner : cell.corners)
        around.push_back({cell.element, corner});
      section.cells_before.push_back(before(around));
      section.cells_after.push_back(after(around));
      centres.push_back(cell.centre());
    }
    section.outline_before = before(ends_of(cut.outline));
    section.outline_after = after(ends_of(cut.outline));
    section.elements_before = before(ends_of(cut.elements));
    section.elements_after = after(ends_of(cut.elements));
    section.fields = fields_at(centres);
    return section;
  };
  return {drawn("Short axis, material of " + height_words(centre_mm), Vector3d::UnitY(), "y (mm)"),
          drawn("Long axis, material of y = 0", Vector3d::UnitZ(), "z (mm)")};
}

}  // namespace diastole
