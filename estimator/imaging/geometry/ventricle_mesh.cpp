#include "estimator/imaging/geometry/ventricle_mesh.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include "estimator/fe/face_points.hpp"
#include "estimator/fe/gauss_points.hpp"
#include "estimator/imaging/geometry/wall_map.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "estimator/mesh/structured.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Vector3d;

/// Value, d/dxi1, d/dxi2, d2/dxi1 dxi2 of a wall at a node; in patient coordinates.
using WallNode = std::array<Vector3d, 4>;

/// Where the nodes are: theta and the fraction of the meridian by xi1 and xi2.
struct NodeGrid {
  const VentricleMeshOptions& options;

  [[nodiscard]] double arc() const { return 2 * std::numbers::pi / static_cast<double>(options.elements[0]); }
  [[nodiscard]] double fraction(double xi2) const {
    const double s = xi2 / static_cast<double>(options.elements[1]);
    const double g = options.base_grading;
    return (1 - g) * s + g * std::sin(0.5 * std::numbers::pi * s);
  }
};

/// The factor that makes an arc of angle h the best cubic.
double arc_factor(double h) { return std::tan(h / 4) / (h / 4); }

WallNode wall_node(const ProlateFrame& frame, const WallMap& map, const NodeGrid& grid, double side,
                   size_t i1, size_t i2) {
  // Central differences of functions that are analytic with a scale of one: right to a part in a million.
  constexpr double step = 1e-3;
  const double xi1 = static_cast<double>(i1), xi2 = static_cast<double>(i2);
  std::array<std::array<Vector3d, 3>, 3> x;  // [xi1 - h, xi1, xi1 + h][likewise xi2]
  double span = 0;
  for (size_t a = 0; a < 3; ++a) {
    const double theta = grid.arc() * (xi1 + step * (static_cast<double>(a) - 1));
    const double end = map.base_mu(side, theta);
    for (size_t b = 0; b < 3; ++b)
      x[a][b] = map.place_mm(side, theta, end * grid.fraction(xi2 + step * (static_cast<double>(b) - 1)));
    if (a == 1) span = end * (grid.fraction(xi2 + step) - grid.fraction(xi2 - step)) / (2 * step);
  }
  const double around = arc_factor(grid.arc()), along = arc_factor(span);
  const Vector3d d1 =
      i2 == 0 ? Vector3d(Vector3d::Zero()) : Vector3d(around * (x[2][1] - x[0][1]) / (2 * step));
  const Vector3d d2 = along * (x[1][2] - x[1][0]) / (2 * step);
  const Vector3d d12 = around * along * (x[2][2] - x[2][0] - x[0][2] + x[0][0]) / (4 * step * step);
  return {frame.patient(x[1][1]), frame.axes * d1, frame.axes * d2, frame.axes * d12};
}

/// By how much xi2 = 0 differs around the collapsed apex is rounding: all of its nodes take the first one's values.
void put(NodeField& field, const ElementGrid& grid, size_t i1, size_t i2, const WallNode& inner,
         const WallNode& outer) {
  const size_t layers = grid.elements[2];
  for (size_t i3 = 0; i3 <= layers; ++i3) {
    const double t = static_cast<double>(i3) / static_cast<double>(layers);
    const size_t node = grid.node(i1, i2, i3);
    for (size_t d = 0; d < 4; ++d) {
      const Vector3d across = (outer[d] - inner[d]) / static_cast<double>(layers);
      const Vector3d at = (1 - t) * inner[d] + t * outer[d];
      for (size_t i = 0; i < 3; ++i) {
        field[dof_of(node, d, i)] = at[static_cast<Eigen::Index>(i)];
        field[dof_of(node, d + 4, i)] = across[static_cast<Eigen::Index>(i)];
      }
    }
  }
}

}  // namespace

HermiteMesh ventricle_mesh(const ProlateFrame& frame, const VentricleWalls& walls,
                           const VentricleMeshOptions& options) {
  const ElementGrid grid{options.elements, true};
  const WallMap map(frame, walls);
  const NodeGrid places{options};
  NodeField field(grid.node_count() * dofs_per_node, 0.0);
  for (size_t i2 = 0; i2 <= options.elements[1]; ++i2) {
    for (size_t i1 = 0; i1 < options.elements[0]; ++i1)
      put(field, grid, i1, i2, wall_node(frame, map, places, -0.5, i1, i2),
          wall_node(frame, map, places, 0.5, i1, i2));
  }
  // Topology, faces and the apex's ties are an ellipsoid's.
  const HermiteMesh pattern = make_ellipsoid({.elements = options.elements});
  for (const auto& [dof, of] : pattern.ties().same)
    field[dof] = field[of];
  for (const size_t dof : pattern.ties().zero)
    field[dof] = 0;
  std::vector<HermiteMesh::Corners> elements = grid_elements(grid);
  return HermiteMesh(std::move(field), std::move(elements), pattern.faces(), {}, pattern.ties());
}

std::vector<double> node_sigmas_mm(const ProlateFrame& frame, const VentricleWalls& walls,
                                   const VentricleMeshOptions& options) {
  const ElementGrid grid{options.elements, true};
  const WallMap map(frame, walls);
  const NodeGrid places{options};
  std::vector<double> sigmas(grid.node_count());
  for (size_t i3 = 0; i3 <= options.elements[2]; ++i3) {
    const double side = static_cast<double>(i3) / static_cast<double>(options.elements[2]) - 0.5;
    for (size_t i1 = 0; i1 < options.elements[0]; ++i1) {
      const double theta = places.arc() * static_cast<double>(i1);
      const double end = map.base_mu(side, theta);
      for (size_t i2 = 0; i2 <= options.elements[1]; ++i2)
        sigmas[grid.node(i1, i2, i3)] =
            map.sigma_mm(side, theta, end * places.fraction(static_cast<double>(i2)));
    }
  }
  return sigmas;
}

MeshMeasures measure_mesh(const HermiteMesh& mesh) {
  MeshMeasures measures;
  measures.least_jacobian = std::numeric_limits<double>::infinity();
  // Seen from a place on the base plane the lid has no volume.
  const ElementFace lid = mesh.faces().top.front();
  const Vector3d on_base = mesh.value(mesh.reference(), {lid.element, {0.5, 1, 0.5}});
  double cavity = 0;
  for (const ElementFace& face : mesh.faces().inner)
    for_each_face_point(face, mesh.gather(face.element, mesh.reference()), [&](const FacePoint& point) {
      cavity += point.weight * (point.position - on_base).dot(point.normal()) / 3;
    });
  measures.cavity_mL = 1e-3 * std::abs(cavity);

  const LineRule<5> rule = line_rule_5();
  double wall = 0;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t q = 0; q < 125; ++q) {
      const std::array<size_t, 3> i{q % 5, q / 5 % 5, q / 25};
      const MaterialPoint point{e, {rule.place[i[0]], rule.place[i[1]], rule.place[i[2]]}};
      const Eigen::Matrix3d tangents = mesh.xi_gradient(mesh.reference(), point);
      const double volume = tangents.determinant();
      wall += rule.weight[i[0]] * rule.weight[i[1]] * rule.weight[i[2]] * volume;
      const double jacobian =
          volume / (tangents.col(0).norm() * tangents.col(1).norm() * tangents.col(2).norm());
      if (jacobian >= measures.least_jacobian) continue;
      measures.least_jacobian = jacobian;
      measures.least_at = point;
    }
  }
  measures.wall_mL = 1e-3 * wall;
  return measures;
}

double mesh_error_mm(const ProlateFrame& frame, const VentricleWalls& walls, const HermiteMesh& mesh) {
  const WallMap map(frame, walls);
  double squares = 0;
  size_t count = 0;
  for (const bool outer : {false, true}) {
    for (const ElementFace& face : outer ? mesh.faces().outer : mesh.faces().inner) {
      for (size_t i = 0; i < 9; ++i) {
        const Xi xi{(static_cast<double>(i % 3) + 0.5) / 3, (static_cast<double>(i / 3) + 0.5) / 3,
                    static_cast<double>(face.side)};
        const Vector3d inside = frame.inside(mesh.value(mesh.reference(), {face.element, xi}));
        squares += std::pow(map.distance_mm(outer ? 0.5 : -0.5, inside), 2);
        ++count;
      }
    }
  }
  return std::sqrt(squares / static_cast<double>(count));
}

std::vector<Vector3d> surface_points(const HermiteMesh& mesh, size_t side) {
  constexpr size_t per_element = 6;
  std::vector<Vector3d> points;
  for (const ElementFace& face : side == 0 ? mesh.faces().inner : mesh.faces().outer) {
    for (size_t i = 0; i < per_element * per_element; ++i) {
      const auto part = [](size_t n) {
        return (static_cast<double>(n) + 0.5) / static_cast<double>(per_element);
      };
      points.push_back(mesh.value(
          mesh.reference(),
          {face.element, {part(i % per_element), part(i / per_element), static_cast<double>(face.side)}}));
    }
  }
  return points;
}

}  // namespace diastole::imaging
