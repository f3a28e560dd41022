#pragma once
// A surface of the specimen that a fluid presses on: the cavity's wall, or the outer wall in a sealed chamber.
//
// The fluid's volume V (behind the wall, on the fluid's side; up to a constant for a chamber around the specimen)
// is the potential of its pressure: the force on the unknowns is p dV/dx, its tangent p d2V/dxdx
// (cavity_load.hpp). What happens at the surface's rim decides whether that holds:
//
//   at a plate       the rim cannot leave the plane z = h of a plate, or the gap that opens is counted
//                    (face_edge.hpp): V is the exact volume between wall and plates, the tangent is symmetric
//   held             no two components of the rim's motion are free: likewise; the lid of a held rim in one oblique
//                    plane (a ventricle in patient coordinates) has a constant share of the volume
//   free             the force is p times the integral of n over the wall alone; it has no potential, and the
//                    tangent has a skew part along the rim (face_edge.hpp)
//
// The rim is where a face of the surface has no neighbour in it; collapsed edges are none.

#include <span>
#include <vector>

#include "estimator/fe/cavity_load.hpp"
#include "estimator/fe/face_edge.hpp"
#include "estimator/fe/supports.hpp"
#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

/// One face of the surface with its rim edges at plates.
struct FluidFace {
  struct Gap {
    FaceEdge edge;
    double plate_z_mm;
  };
  ElementFace face;
  std::vector<Gap> gaps{};

  [[nodiscard]] double volume_mm3(const ElementField& position_mm) const;
  /// Its share of dV/dx, over the face's functions.
  [[nodiscard]] FaceField area_mm2(const ElementField& position_mm) const;
  /// Its share of d2V/dxdx; the symmetric part if the rim is free.
  [[nodiscard]] FaceTangent tangent_mm(const ElementField& position_mm) const;
};

class FluidSurface {
 public:
  FluidSurface() = default;
  /// `plates`: faces of the body bonded to rigid plates z = const by springs; a rim edge that such a face shares is
  /// at its plate. Precondition: those edges lie in planes z = const.
  FluidSurface(const HermiteMesh& mesh, const std::vector<ElementFace>& faces, const HeldDofs& held,
               std::span<const ElementFace> plates);

  [[nodiscard]] const std::vector<FluidFace>& faces() const { return faces_; }
  [[nodiscard]] const std::vector<FaceEdge>& free_rim() const { return free_rim_; }
  /// The pressure has a potential, the volume.
  [[nodiscard]] bool closed() const { return free_rim_.empty() && !faces_.empty(); }

  /// Precondition: closed().
  [[nodiscard]] double volume_mm3(const HermiteMesh& mesh, const NodeField& position_mm) const;

 private:
  std::vector<FluidFace> faces_;
  std::vector<FaceEdge> free_rim_;
  double lid_mm3_ = 0;
};

}  // namespace diastole
