#include "tests/estimator/reconstruction/tagged_motion.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/mesh/point_locator.hpp"

namespace diastole::test {
namespace {

constexpr int loaded_frames = 4, slices = 6;
constexpr double sigma_kPa = 0.02, largest_kPa = 3.0;
constexpr double inner_mm = 22.5, outer_mm = 50.0, half_height_mm = 42.5;

using Eigen::Vector3d;

struct Slice {
  Vector3d normal;
  Vector3d across;  ///< two directions in the image, from `centre`
  Vector3d up;
  Vector3d centre;
};

/// A random slice of the protocol, and one of its two tag directions.
template <class Random>
Slice random_slice(Random& random, bool along_axis) {
  std::uniform_int_distribution<int> number(0, slices - 1), coin(0, 1);
  const double sign = coin(random) == 0 ? 1.0 : -1.0;
  if (!along_axis || coin(random) == 0) {
    const double z_mm = -30.0 + 12.0 * number(random);
    return {Vector3d(1, sign, 0).normalized(), Vector3d::UnitX(), Vector3d::UnitY(), Vector3d(0, 0, z_mm)};
  }
  const double angle = number(random) * std::numbers::pi / slices;
  const Vector3d e(std::cos(angle), std::sin(angle), 0);
  return {(e + sign * Vector3d::UnitZ()).normalized(), e, Vector3d::UnitZ(), Vector3d::Zero()};
}

bool in_gel(const Vector3d& X) {
  const double radius = std::hypot(X[0], X[1]);
  return radius > inner_mm + 0.5 && radius < outer_mm - 0.5 && std::abs(X[2]) < half_height_mm - 0.5;
}

}  // namespace

HermiteMesh small_gel() { return make_annulus({.elements = {4, 2, 1}}); }

NodeField inflation(const HermiteMesh& mesh, double amount_mm) {
  // u = amount (A/R) e_R cos²(pi z / 2h); nodal derivatives by central differences along xi of the reference.
  const auto motion = [&](const Vector3d& X) -> Vector3d {
    const double radius = std::hypot(X[0], X[1]);
    const double height = std::cos(0.5 * std::numbers::pi * X[2] / half_height_mm);
    return amount_mm * inner_mm / (radius * radius) * height * height * Vector3d(X[0], X[1], 0);
  };
  NodeField field(mesh.node_count() * dofs_per_node, 0.0);
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    for (size_t corner = 0; corner < corners; ++corner) {
      for (size_t derivative = 0; derivative < nodal_derivatives; ++derivative) {
        Vector3d sum = Vector3d::Zero();
        constexpr double step = 0.02;
        for (size_t signs = 0; signs < 8; ++signs) {
          if ((signs & ~derivative) != 0) continue;
          Xi xi{};
          double factor = 1.0;
          for (size_t k = 0; k < 3; ++k) {
            xi[k] = static_cast<double>((corner >> k) & 1);
            if (((derivative >> k) & 1) == 0) continue;
            const double side = ((signs >> k) & 1) != 0 ? 1.0 : -1.0;
            xi[k] += side * step;
            factor *= side / (2 * step);
          }
          sum += factor * motion(mesh.value(mesh.reference(), {e, xi}));
        }
        for (size_t i = 0; i < 3; ++i) {
          field[dof_of(mesh.element(e)[corner], derivative, i)] = sum[static_cast<Eigen::Index>(i)];
        }
      }
    }
  }
  return field;
}

Measurement tagged_inflation(const HermiteMesh& mesh, double amount_mm, const TaggedOptions& options) {
  std::mt19937_64 random(options.seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  std::uniform_real_distribution<double> place(-outer_mm, outer_mm), uniform(0.0, 1.0);
  const PointLocator locator(mesh, mesh.reference());
  Measurement measurement;
  for (int frame = 0; frame <= loaded_frames; ++frame) {
    const double load = static_cast<double>(frame) / loaded_frames;
    measurement.frames.push_back({0.1 * frame, load * largest_kPa, sigma_kPa});
    if (std::find(options.frames.begin(), options.frames.end(), frame) == options.frames.end()) continue;
    const NodeField moved = inflation(mesh, load * amount_mm);
    for (size_t made = 0; made < options.tags_a_frame;) {
      const Slice slice = random_slice(random, options.along_axis);
      const double up_mm = place(random), across_mm = place(random);
      const Vector3d seen = slice.centre + across_mm * slice.across + up_mm * slice.up;
      // The material that is seen there, by fixed-point iteration x = X + u(X).
      Vector3d X = seen;
      std::optional<MaterialPoint> point;
      for (int step = 0; step < 60 && in_gel(X); ++step) {
        point = locator.find(X, point)->point;
        const Vector3d next = seen - mesh.value(moved, *point);
        const bool found = (next - X).norm() < 1e-9;
        X = next;
        if (found) break;
      }
      if (!in_gel(X)) continue;
      const bool wild = uniform(random) < options.wild_share;
      const double error_mm =
          options.noise * options.sigma_mm * normal(random) + (wild ? 30.0 * (uniform(random) - 0.5) : 0.0);
      const Vector3d x = seen + error_mm * slice.normal;
      measurement.tags.push_back({frame,
                                  {slice.normal[0], slice.normal[1], slice.normal[2]},
                                  slice.normal.dot(X),
                                  {x[0], x[1], x[2]},
                                  options.sigma_mm});
      ++made;
    }
  }
  return measurement;
}

}  // namespace diastole::test
