#pragma once
// The inverse map: which material point is at a given place of the reference or of a deformed configuration.
//
//   PointLocator locator(mesh, mesh.reference());       // or a state's deformed positions
//   std::optional<LocatedPoint> found = locator.find(X_mm);
//
// Newton's method on x(xi) = x in the elements whose bounding spheres are near. A point slightly outside the
// body (measurement noise at a wall) is extrapolated: xi may leave 0..1 by `outside_xi`; `overshoot_xi` says
// by how much it did. A point inside wins over an extrapolated one, and the smaller overshoot wins among
// those. The locator copies what it needs, and may be shared between threads.

#include <Eigen/Dense>
#include <optional>
#include <span>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

struct LocatorOptions {
  double outside_xi = 0.25;     ///< largest extrapolation beyond 0..1 in any direction
  double tolerance_mm = 1e-10;  ///< distance at which Newton's method stops
};

struct LocatedPoint {
  MaterialPoint point;
  double overshoot_xi = 0.0;  ///< 0 inside the element
};

class PointLocator {
 public:
  PointLocator(const HermiteMesh& mesh, std::span<const double> positions_mm, LocatorOptions options = {});

  /// `guess` (where the point was in a slightly different configuration) is tried first.
  [[nodiscard]] std::optional<LocatedPoint> find(const Eigen::Vector3d& place_mm,
                                                 std::optional<MaterialPoint> guess = {}) const;
  /// In the guess's element alone, extrapolated as far as Newton's method comes.
  [[nodiscard]] std::optional<LocatedPoint> find_beside(const Eigen::Vector3d& place_mm,
                                                        const MaterialPoint& guess) const;

  /// The located configuration, element by element.
  [[nodiscard]] std::span<const ElementField> elements() const { return elements_; }

 private:
  struct Sphere {
    Eigen::Vector3d centre_mm;
    double radius_mm;
  };

  [[nodiscard]] std::optional<LocatedPoint> find_in(size_t element, const Eigen::Vector3d& place_mm, Xi start,
                                                    double outside_xi) const;

  LocatorOptions options_;
  std::vector<ElementField> elements_;
  std::vector<Sphere> spheres_;
};

}  // namespace diastole
