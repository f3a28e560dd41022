#include "tests/estimator/explain/simulated_field.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace diastole::explain {

FieldCase simulated_case(const SimulatedField& field) {
  FieldCase result;
  result.C1_start_kPa = {7.0, 0.0};
  result.C1_bounds_kPa = {1.0, 20.0};
  result.measurement.frames.push_back({0.0, 0.0, 0.005});
  FieldSolver solver(small_mesh, result.locator);
  solver.set(field.truth, field.C1_kPa);
  std::mt19937 random(field.seed);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::normal_distribution<double> noise_mm(0.0, field.sigma_mm);
  for (size_t slot = 0; slot < field.pressures_kPa.size(); ++slot) {
    const int frame = static_cast<int>(slot) + 1;
    result.measurement.frames.push_back({0.1 * frame, field.pressures_kPa[slot], 0.005});
    if (!solver.solve(slot, field.pressures_kPa[slot])) return result;
    const NodeField moved_mm = solver.seen_displacement_mm(slot);
    for (size_t i = 0; i < field.points; ++i) {
      const double radius_mm = std::lerp(24.5, 49.5, share(random));
      const double theta = 2.0 * std::numbers::pi * share(random);
      const Eigen::Vector3d X_mm(radius_mm * std::cos(theta), radius_mm * std::sin(theta),
                                 std::lerp(-42.0, 42.0, share(random)));
      const auto place = solver.reference().find(X_mm);
      if (!place) continue;
      Eigen::Vector3d x_mm = X_mm + solver.mesh().value(moved_mm, place->point);
      for (double& component : x_mm)
        component += noise_mm(random);
      result.measurement.points.push_back(
          {frame, {X_mm[0], X_mm[1], X_mm[2]}, {x_mm[0], x_mm[1], x_mm[2]}, field.sigma_mm});
    }
  }
  return result;
}

}  // namespace diastole::explain
