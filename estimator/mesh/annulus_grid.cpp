#include "estimator/mesh/annulus_grid.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "estimator/mesh/structured.hpp"

namespace diastole {
namespace {

constexpr double rad_per_deg = std::numbers::pi / 180.0;

NodeField node_positions(const AnnulusGrid& grid) {
  const size_t around = grid.angles_deg.size();
  const size_t up = grid.heights_mm.size();
  NodeField field(around * up * grid.radii_mm.size() * dofs_per_node, 0.0);
  for (size_t i3 = 0; i3 < grid.radii_mm.size(); ++i3) {
    for (size_t i2 = 0; i2 < up; ++i2) {
      for (size_t i1 = 0; i1 < around; ++i1) {
        const size_t node = i1 + around * (i2 + up * i3);
        const double angle = rad_per_deg * grid.angles_deg[i1];
        const std::array<double, 2> radial{std::cos(angle), std::sin(angle)};
        const std::array<double, 2> along{-std::sin(angle), std::cos(angle)};
        for (size_t i = 0; i < 2; ++i) {
          field[dof_of(node, 0, i)] = grid.radii_mm[i3] * radial[i];
          field[dof_of(node, 1, i)] = grid.radii_mm[i3] * along[i];
          field[dof_of(node, 4, i)] = radial[i];
          field[dof_of(node, 5, i)] = along[i];
        }
        field[dof_of(node, 0, 2)] = grid.heights_mm[i2];
        field[dof_of(node, 2, 2)] = 1.0;
      }
    }
  }
  return field;
}

}  // namespace

HermiteMesh make_annulus(const AnnulusGrid& grid) {
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
  const ElementGrid layout{elements, true};
  return HermiteMesh(node_positions(grid), grid_elements(layout), grid_faces(layout), std::move(scales));
}

}  // namespace diastole
