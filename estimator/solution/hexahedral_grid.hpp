#pragma once
// A solution on plain hexahedra, as other laboratories' programs read it: each element of the Hermite mesh sampled at equal steps of xi,
// places that elements share being one point. At a collapsed edge (a ventricle's apex) a hexahedron is a wedge.
//
// Point data: displacement_mm exactly; strain, stress and the other fields of solution_grid.hpp as they are at the point, the mean over
// elements that meet there. Cell data: element. Field data: pressure_kPa.

#include <array>
#include <span>

#include "estimator/grids/feb_file.hpp"
#include "estimator/solution/solution_grid.hpp"

namespace diastole {

using Sampling = std::array<size_t, 3>;  ///< cells an element along xi1, xi2, xi3, >= 1

struct HexahedralMesh {
  FieldGrid grid;  ///< undeformed, without steps
  std::vector<std::vector<size_t>>
      points;  ///< of each element: number of the sample i + (n1 + 1) (j + (n2 + 1) k)
  std::vector<MaterialPoint> centres;  ///< of each cell
  Sampling sampling{};

  /// Sampled faces of an element's face, outwards from the material; without those that are collapsed to a line.
  [[nodiscard]] std::vector<GridCell> faces(const ElementFace& face) const;
};

HexahedralMesh hexahedral_mesh(const HermiteMesh& mesh, const Sampling& sampling);

/// Precondition: at least one frame; states are this model's.
FieldGrid hexahedral_grid(const ElasticModel& model, std::span<const SolvedFrame> frames,
                          const Sampling& sampling);

/// The same body for FEBio, loaded by the frames' pressures one after the other. Throws std::invalid_argument with the reason if FEBio has
/// nothing that is the same: another law, ends on springs, a chamber, active tension.
FebModel febio_model(const ElasticModel& model, std::span<const SolvedFrame> frames,
                     const HexahedralMesh& mesh);

}  // namespace diastole
