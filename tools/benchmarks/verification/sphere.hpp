#pragma once
// Half a thick spherical shell of neo-Hookean material on a frictionless plate: the model, and the closed form of its
// pressure, which has a maximum. For tests and figures.
//
//   W = C1 (2 l^2 + l^-4 - 3), l = r/R;  P = integral of W'(l) / (l^3 - 1) dl from the outer to the inner wall
//     = 4 C1 [1/l + 1/(4 l^4)]  at the outer wall minus the same at the inner wall

#include <array>
#include <cmath>
#include <numbers>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/mesh/ellipsoid.hpp"

namespace diastole {

struct HalfSphere {
  double c1_kPa = 6.5;
  double inner_mm = 20.0;
  double outer_mm = 23.0;

  /// `volume_change_mL` of the half sphere's cavity.
  [[nodiscard]] double pressure_kPa(double volume_change_mL) const {
    const double cubes_mm3 = 1e3 * volume_change_mL * 3.0 / (2.0 * std::numbers::pi);
    const auto term = [&](double radius_mm) {
      const double stretch = std::cbrt(std::pow(radius_mm, 3) + cubes_mm3) / radius_mm;
      return 1.0 / stretch + 0.25 / std::pow(stretch, 4);
    };
    return 4.0 * c1_kPa * (term(outer_mm) - term(inner_mm));
  }

  /// Precondition: a multiple of four elements around.
  [[nodiscard]] ElasticModel model(std::array<size_t, 3> elements) const {
    EllipsoidShape shape;
    shape.inner_axes_mm = {inner_mm, inner_mm};
    shape.outer_axes_mm = {outer_mm, outer_mm};
    shape.base_z_mm = 0.0;
    shape.base_grading = 0.0;
    shape.elements = elements;
    HermiteMesh mesh = make_ellipsoid(shape);
    HeldDofs held = hold_nothing(mesh);
    hold_face_component(mesh, mesh.faces().top, 2, held);
    // On the axes of symmetry, where nothing moves sideways.
    const size_t base = elements[0] * elements[1];
    held[dof_of(base, 0, 1)] = held[dof_of(base + elements[0] / 2, 0, 1)] =
        held[dof_of(base + elements[0] / 4, 0, 0)] = 1;
    return ElasticModel(std::move(mesh), *find_law("neo-hookean"), {.parameters = {c1_kPa}, .held = held});
  }
};

}  // namespace diastole
