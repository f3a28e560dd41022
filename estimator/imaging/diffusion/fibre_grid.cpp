#include "estimator/imaging/diffusion/fibre_grid.hpp"

#include <array>

#include "estimator/mesh/bezier.hpp"

namespace diastole::imaging {

BezierGrid fibre_grid(const FibreEstimate& field) {
  // Places of the cubic through an element: off the collapsed edge of an apex, where there are no wall axes.
  constexpr std::array<double, 4> places{0.07, 0.33, 0.67, 0.93};
  const HermiteMesh& mesh = field.lattice.mesh;
  BezierGrid grid;
  std::vector<GridArray> arrays{
      {"fibre_direction", 3, {}}, {"helix_deg", 1, {}}, {"transverse_deg", 1, {}}, {"sigma_deg", 1, {}}};
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    append_in_vtk_order(bezier_of(mesh.gather(e, mesh.reference())).transpose(), grid.points_mm);
    const auto sample = [&](const Xi& xi) {
      const FibreAt at = field.at({e, xi});
      Eigen::VectorXd numbers(6);
      numbers << at.direction, at.angles.helix_deg, at.angles.transverse_deg, at.sigma_deg;
      return numbers;
    };
    append_in_vtk_order(bezier_through(places, sample), arrays);
  }
  grid.steps.push_back({0.0, std::move(arrays), {}});
  return grid;
}

}  // namespace diastole::imaging
