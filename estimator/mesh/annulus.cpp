#include "estimator/mesh/annulus.hpp"

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "estimator/mesh/structured.hpp"

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

NodeField node_positions(const AnnulusShape& shape) {
  const auto [around, up, out] = shape.elements;
  NodeField field(around * (up + 1) * (out + 1) * dofs_per_node, 0.0);
  const double arc = 2.0 * std::numbers::pi / static_cast<double>(around);
  const double tangent = 4.0 * std::tan(arc / 4.0);
  for (size_t i3 = 0; i3 <= out; ++i3) {
    const Ordinate r = graded_radius(shape, i3);
    for (size_t i2 = 0; i2 <= up; ++i2) {
      const Ordinate z = graded_height(shape, i2);
      for (size_t i1 = 0; i1 < around; ++i1) {
        const size_t node = i1 + around * (i2 + (up + 1) * i3);
        const double angle = arc * static_cast<double>(i1);
        const std::array<double, 2> radial{std::cos(angle), std::sin(angle)};
        const std::array<double, 2> along{-std::sin(angle), std::cos(angle)};
        for (size_t i = 0; i < 2; ++i) {
          field[dof_of(node, 0, i)] = r.value * radial[i];
          field[dof_of(node, 1, i)] = r.value * tangent * along[i];
          field[dof_of(node, 4, i)] = r.slope * radial[i];
          field[dof_of(node, 5, i)] = r.slope * tangent * along[i];
        }
        field[dof_of(node, 0, 2)] = z.value;
        field[dof_of(node, 2, 2)] = z.slope;
      }
    }
  }
  return field;
}

}  // namespace

HermiteMesh make_annulus(const AnnulusShape& shape) {
  const ElementGrid grid{shape.elements, true};
  return HermiteMesh(node_positions(shape), grid_elements(grid), grid_faces(grid));
}

}  // namespace diastole
