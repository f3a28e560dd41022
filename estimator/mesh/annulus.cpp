#include "estimator/mesh/annulus.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/mesh/structured.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

/// A coordinate along one element direction at a node, and its derivative with respect to that xi.
struct Ordinate {
  double value;
  double slope;
};

Ordinate graded_height(const AnnulusShape& shape, size_t level) {
  const double count = static_cast<double>(shape.elements[1]);
  const double s = 2.0 * static_cast<double>(level) / count - 1.0;
  const double g = shape.plate_grading;
  const double quarter_turn = std::numbers::pi / 2.0;
  const double z = (1.0 - g) * s + g * std::sin(quarter_turn * s);
  const double dz_ds = (1.0 - g) + g * quarter_turn * std::cos(quarter_turn * s);
  return {0.5 * shape.height_mm * z, 0.5 * shape.height_mm * dz_ds * 2.0 / count};
}

Ordinate graded_radius(const AnnulusShape& shape, size_t layer) {
  const double count = static_cast<double>(shape.elements[2]);
  const double s = static_cast<double>(layer) / count;
  const double g = shape.wall_grading;
  const double thickness = shape.outer_radius_mm - shape.inner_radius_mm;
  const double stretch = std::log(shape.outer_radius_mm / shape.inner_radius_mm);
  const double logarithmic = shape.inner_radius_mm * std::exp(stretch * s);
  return {(1.0 - g) * (shape.inner_radius_mm + thickness * s) + g * logarithmic,
          ((1.0 - g) * thickness + g * stretch * logarithmic) / count};
}

/// `turn` is the nodal derivative around over the radius.
NodeField node_positions(const std::vector<double>& angles_rad, const std::vector<Ordinate>& heights,
                         const std::vector<Ordinate>& radii, double turn) {
  NodeField field(angles_rad.size() * heights.size() * radii.size() * dofs_per_node, 0.0);
  size_t node = 0;
  for (const Ordinate& r : radii) {
    for (const Ordinate& z : heights) {
      for (const double angle : angles_rad) {
        const std::array<double, 2> radial{std::cos(angle), std::sin(angle)};
        const std::array<double, 2> along{-std::sin(angle), std::cos(angle)};
        for (size_t i = 0; i < 2; ++i) {
          field[dof_of(node, 0, i)] = r.value * radial[i];
          field[dof_of(node, 1, i)] = r.value * turn * along[i];
          field[dof_of(node, 4, i)] = r.slope * radial[i];
          field[dof_of(node, 5, i)] = r.slope * turn * along[i];
        }
        field[dof_of(node, 0, 2)] = z.value;
        field[dof_of(node, 2, 2)] = z.slope;
        ++node;
      }
    }
  }
  return field;
}

std::vector<Ordinate> of_unit_slope(const std::vector<double>& values) {
  std::vector<Ordinate> ordinates;
  for (const double value : values)
    ordinates.push_back({value, 1.0});
  return ordinates;
}

}  // namespace

HermiteMesh make_annulus(const AnnulusShape& shape) {
  const auto [around, up, out] = shape.elements;
  const double arc = 2.0 * std::numbers::pi / static_cast<double>(around);
  std::vector<double> angles_rad;
  std::vector<Ordinate> heights, radii;
  for (size_t i = 0; i < around; ++i)
    angles_rad.push_back(arc * static_cast<double>(i));
  for (size_t i = 0; i <= up; ++i)
    heights.push_back(graded_height(shape, i));
  for (size_t i = 0; i <= out; ++i)
    radii.push_back(graded_radius(shape, i));
  const ElementGrid grid{shape.elements, true};
  return HermiteMesh(node_positions(angles_rad, heights, radii, 4.0 * std::tan(arc / 4.0)),
                     grid_elements(grid), grid_faces(grid));
}

HermiteMesh make_annulus_on(const AnnulusGrid& grid) {
  const std::array<size_t, 3> elements{grid.angles_deg.size(), grid.heights_mm.size() - 1,
                                       grid.radii_mm.size() - 1};
  std::vector<HermiteMesh::Scales> scales;
  for (size_t i3 = 0; i3 < elements[2]; ++i3) {
    for (size_t i2 = 0; i2 < elements[1]; ++i2) {
      for (size_t i1 = 0; i1 < elements[0]; ++i1) {
        const bool last = i1 + 1 == elements[0];
        const double arc_deg = last ? grid.angles_deg.front() + 360.0 - grid.angles_deg.back()
                                    : grid.angles_deg[i1 + 1] - grid.angles_deg[i1];
        const std::array<double, 3> size{4.0 * std::tan(rad_per_deg * arc_deg / 4.0),
                                         grid.heights_mm[i2 + 1] - grid.heights_mm[i2],
                                         grid.radii_mm[i3 + 1] - grid.radii_mm[i3]};
        HermiteMesh::Scales& scale = scales.emplace_back();
        for (size_t a = 0; a < hermite_functions; ++a) {
          scale[a] = 1.0;
          for (size_t k = 0; k < 3; ++k)
            if (((hermite_derivative(a) >> k) & 1) != 0) scale[a] *= size[k];
        }
      }
    }
  }
  std::vector<double> angles_rad;
  for (const double angle_deg : grid.angles_deg)
    angles_rad.push_back(rad_per_deg * angle_deg);
  const ElementGrid layout{elements, true};
  return HermiteMesh(
      node_positions(angles_rad, of_unit_slope(grid.heights_mm), of_unit_slope(grid.radii_mm), 1.0),
      grid_elements(layout), grid_faces(layout), std::move(scales));
}

}  // namespace diastole
