#pragma once
// Where on the deformed body a tag point was really seen, and how far the measurement is from there.
//
// A tag point is the deformed place of some material of the plane n·X = c, seen with an error s along n
// (standard deviation sigma). Given a motion x(X), the two conditions
//
//        x(X) + s n = x_seen          n·X = c                       (four equations for X and s)
//
// have one solution near the observation: X slides along the tag plane until its image lies on the line
// through x_seen along n. s is then exactly the measurement's error under this motion, so s / sigma is a unit
// normal residual whatever the deformation. (To first order s = r / (n·F⁻¹n), with r = n·X(x_seen) - c the
// pulled-back residual of Eq. 2; solving for s also removes the bias that r has from the motion's curvature.)
//
// Differentiating both conditions with F = dx/dX:   ds = -(n·F⁻¹ du) / (n·F⁻¹ n).
// Lengths in mm.

#include <Eigen/Dense>
#include <optional>
#include <span>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/hermite_mesh.hpp"
#include "estimator/mesh/point_locator.hpp"

namespace diastole {

/// A place or a direction of a measurement.
inline Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

struct TagMatch {
  MaterialPoint point;  ///< X, in mesh coordinates; slightly outside the body where noise or misfit puts it
  double error_mm;      ///< s
  Eigen::Vector3d by_motion;     ///< ds/dx at the point: ds = by_motion · du
  Eigen::Vector3d X_mm;          ///< the point's undeformed place
  Eigen::Vector3d by_reference;  ///< - F^T by_motion = n / (n·F⁻¹n)
};

/// Where to start the search for a tag point: its seen place in the motion that `deformed` locates, or places on its
/// line of error when noise has put it where the mesh cannot be extrapolated to. Empty when all are outside.
std::optional<MaterialPoint> find_tag(const PointLocator& deformed, const TagPoint& tag);

/// `reference` locates points of the undeformed mesh; `deformed` are the deformed positions, element by element
/// (local_field.hpp). `guess` is where the point was for a similar motion.
/// Empty when the search leaves the body, or when the plane is so sheared that n·F⁻¹n < 0.1.
std::optional<TagMatch> match_tag(const PointLocator& reference, std::span<const ElementField> deformed,
                                  const TagPoint& tag, const MaterialPoint& guess);

}  // namespace diastole
