#pragma once
// The gel phantom and helpers that the solver's tests share.

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/fe/elastic_system.hpp"
#include "estimator/materials/energy_law.hpp"
#include "estimator/mesh/annulus.hpp"

namespace diastole {

inline AnnulusShape gel_shape(std::array<size_t, 3> elements) {
  AnnulusShape shape;
  shape.elements = elements;
  return shape;
}

inline ElasticModel gel(double c1_kPa, std::array<size_t, 3> elements = {8, 4, 1},
                        ElasticOptions options = {}) {
  options.parameters = {c1_kPa};
  options.solve.check_stability = true;
  return ElasticModel(make_annulus(gel_shape(elements)), *find_law("neo-hookean"), std::move(options));
}

/// So many times as stiff within 10 mm of a place in the wall, with an edge of some millimetres.
inline StiffnessField inclusion(double contrast) {
  return [=](const Eigen::Vector3d& X_mm) {
    const double distance_mm = (X_mm - Eigen::Vector3d(10.0, 35.0, 8.0)).norm();
    return 1.0 + 0.5 * (contrast - 1.0) * (1.0 - std::tanh((distance_mm - 10.0) / 2.0));
  };
}

/// A slice of the gel between frictionless plates; three dofs at nodes where symmetry makes them zero stop rigid motion.
inline ElasticModel plane_strain_slice(double c1_kPa, size_t layers) {
  AnnulusShape shape = gel_shape({8, 1, layers});
  shape.height_mm = 20.0;
  shape.plate_grading = 0.0;
  HermiteMesh mesh = make_annulus(shape);
  HeldDofs held = hold_nothing(mesh);
  hold_face_component(mesh, mesh.faces().bottom, 2, held);
  hold_face_component(mesh, mesh.faces().top, 2, held);
  held[dof_of(0, 0, 1)] = held[dof_of(4, 0, 1)] = held[dof_of(2, 0, 0)] = 1;
  return ElasticModel(std::move(mesh), *find_law("neo-hookean"),
                      {.parameters = {c1_kPa}, .held = held, .solve = {.check_stability = true}});
}

/// A law with fibres, stiffening and a full tangent, for the paths that the neo-Hookean law does not take.
struct FibreExponential {
  static constexpr std::string_view name = "test-fibre-exponential";
  static constexpr bool needs_axes = true;
  static constexpr std::array<LawParameter, 2> parameters{
      {{"C_kPa", "scale", 0.0, 3.0, "kPa"}, {"b", "exponent", 0.0, 2.0}}};
  template <class Scalar>
  static Scalar energy(const SymmetricTensor<Scalar>& c, const std::array<Scalar, 2>& values) {
    using std::exp;
    const Scalar half = constant<Scalar>(0.5);
    const Scalar one = constant<Scalar>(1.0);
    const Scalar ff = half * (c[0] - one);
    const Scalar ss = half * (c[1] - one);
    const Scalar nn = half * (c[2] - one);
    const Scalar q =
        values[1] * ff * ff + ss * ss + nn * nn + half * (c[3] * c[3] + c[4] * c[4] + c[5] * c[5]);
    return values[0] * (exp(q) - one);
  }
};

inline const Law& fibre_exponential() {
  static const EnergyLaw<FibreExponential> law;
  return law;
}

/// A state with all free unknowns moved at random, by up to `amount` mm (and kPa).
inline ElasticState shaken(const ElasticSystem& system, const ElasticState& state, double amount,
                           unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-amount, amount);
  std::vector<double> step(system.equations().unknowns());
  for (double& value : step)
    value = unit(random);
  return system.moved(state, step, 1.0);
}

inline double largest(const std::vector<double>& values) {
  double most = 0.0;
  for (const double value : values)
    most = std::max(most, std::abs(value));
  return most;
}

inline double largest_difference(const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0.0;
  for (size_t i = 0; i < a.size(); ++i)
    most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

}  // namespace diastole
