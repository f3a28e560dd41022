#include "estimator/mesh/ellipsoid.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/mesh/structured.hpp"

namespace diastole {
namespace {

/// In the meridian plane: distance from the axis, height.
using Meridian = Eigen::Vector2d;

/// Position and derivatives with respect to xi2 and xi3 of a node, in the meridian plane.
struct MeridianNode {
  Meridian value;
  Meridian d2;
  Meridian d3;
  Meridian d23;
};

MeridianNode meridian_node(const EllipsoidShape& shape, size_t i2, size_t i3) {
  const double n2 = static_cast<double>(shape.elements[1]);
  const double n3 = static_cast<double>(shape.elements[2]);
  const double t = static_cast<double>(i3) / n3;
  // Semi-axes and their derivatives with respect to t.
  const double da = shape.outer_axes_mm[0] - shape.inner_axes_mm[0];
  const double dc = shape.outer_axes_mm[1] - shape.inner_axes_mm[1];
  const double a = shape.inner_axes_mm[0] + t * da;
  const double c = shape.inner_axes_mm[1] + t * dc;
  // The meridian angle of the base, its fraction at this node, and the tangent factor 4 tan(h/4) of the angle
  // h that an element spans here.
  const double cosine = -shape.base_z_mm / c;
  const double base = std::acos(cosine);
  const double dbase = -shape.base_z_mm * dc / (c * c * std::sqrt(1.0 - cosine * cosine));
  const double g = shape.base_grading;
  const double quarter_turn = 0.5 * std::numbers::pi;
  const double uniform = static_cast<double>(i2) / n2;
  const double s = (1.0 - g) * uniform + g * std::sin(quarter_turn * uniform);
  const double slope = (1.0 - g) + g * quarter_turn * std::cos(quarter_turn * uniform);
  const double quarter = base * slope / (4.0 * n2);
  const double factor = 4.0 * std::tan(quarter);
  const double dfactor = dbase * slope / n2 / (std::cos(quarter) * std::cos(quarter));

  const double psi = s * base;
  const Meridian along(a * std::cos(psi), c * std::sin(psi));       // d/dpsi
  const Meridian bend(-a * std::sin(psi), c * std::cos(psi));       // d2/dpsi2
  const Meridian thicken(da * std::sin(psi), -dc * std::cos(psi));  // d/dt at fixed psi
  const Meridian thicken_along(da * std::cos(psi), dc * std::sin(psi));
  MeridianNode node;
  node.value = Meridian(a * std::sin(psi), -c * std::cos(psi));
  node.d2 = factor * along;
  node.d3 = (thicken + s * dbase * along) / n3;
  node.d23 = (dfactor * along + factor * (thicken_along + s * dbase * bend)) / n3;
  if (i2 == 0) node.value[0] = node.d3[0] = 0.0;
  if (i2 == shape.elements[1]) {
    node.value[1] = shape.base_z_mm;
    node.d3[1] = 0.0;
  }
  return node;
}

/// The collapsed edge at the apex (ellipsoid.hpp).
DofTies apex_ties(const ElementGrid& grid) {
  constexpr size_t value = 0;
  constexpr size_t d1 = 1;
  constexpr size_t d3 = 4;
  constexpr size_t d13 = 5;
  DofTies ties;
  for (size_t i3 = 0; i3 <= grid.elements[2]; ++i3) {
    for (size_t i1 = 0; i1 < grid.elements[0]; ++i1) {
      for (size_t i = 0; i < 3; ++i) {
        const size_t node = grid.node(i1, 0, i3);
        ties.zero.push_back(dof_of(node, d1, i));
        ties.zero.push_back(dof_of(node, d13, i));
        if (i1 == 0) continue;
        const size_t first = grid.node(0, 0, i3);
        ties.same.emplace_back(dof_of(node, value, i), dof_of(first, value, i));
        ties.same.emplace_back(dof_of(node, d3, i), dof_of(first, d3, i));
      }
    }
  }
  return ties;
}

}  // namespace

HermiteMesh make_ellipsoid(const EllipsoidShape& shape) {
  const ElementGrid grid{shape.elements, true};
  NodeField field(grid.node_count() * dofs_per_node, 0.0);
  const double arc = 2.0 * std::numbers::pi / static_cast<double>(shape.elements[0]);
  const double turn = 4.0 * std::tan(arc / 4.0);
  for (size_t i3 = 0; i3 <= shape.elements[2]; ++i3) {
    for (size_t i2 = 0; i2 <= shape.elements[1]; ++i2) {
      const MeridianNode meridian = meridian_node(shape, i2, i3);
      const std::array<Meridian, 4> derivatives{meridian.value, meridian.d2, meridian.d3, meridian.d23};
      for (size_t i1 = 0; i1 < shape.elements[0]; ++i1) {
        const size_t node = grid.node(i1, i2, i3);
        const double theta = arc * static_cast<double>(i1);
        for (size_t k = 0; k < 4; ++k) {
          const auto [radius, height] = std::pair(derivatives[k][0], derivatives[k][1]);
          field[dof_of(node, 2 * k, 0)] = radius * std::cos(theta);
          field[dof_of(node, 2 * k, 1)] = radius * std::sin(theta);
          field[dof_of(node, 2 * k, 2)] = height;
          field[dof_of(node, 2 * k + 1, 0)] = -radius * turn * std::sin(theta);
          field[dof_of(node, 2 * k + 1, 1)] = radius * turn * std::cos(theta);
        }
      }
    }
  }
  MeshFaces faces = grid_faces(grid);
  faces.bottom.clear();
  return HermiteMesh(std::move(field), grid_elements(grid), std::move(faces), {}, apex_ties(grid));
}

FibreField ellipsoid_fibres(const EllipsoidShape& shape, double endo_deg, double epi_deg) {
  const ElementGrid grid{shape.elements, true};
  std::vector<double> angle_deg(grid.node_count());
  for (size_t i3 = 0; i3 <= shape.elements[2]; ++i3) {
    const double t = static_cast<double>(i3) / static_cast<double>(shape.elements[2]);
    for (size_t i2 = 0; i2 <= shape.elements[1]; ++i2) {
      for (size_t i1 = 0; i1 < shape.elements[0]; ++i1)
        angle_deg[grid.node(i1, i2, i3)] = std::lerp(endo_deg, epi_deg, t);
    }
  }
  return FibreField(std::move(angle_deg));
}

}  // namespace diastole
