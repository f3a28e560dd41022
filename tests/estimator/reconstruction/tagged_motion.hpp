#pragma once
// Tag points of a motion that is known exactly: a gel that is inflated, without any solver.

#include <vector>

#include "estimator/io/measurement.hpp"
#include "estimator/mesh/annulus.hpp"

namespace diastole::test {

/// 4 x 2 x 1 elements: coarse, but quick.
HermiteMesh small_gel();

/// An incompressible inflation of the gel's cavity that ends at the plates, as nodal displacements (so that it lies in
/// the space of fields): up to `inner_mm` outwards at the inner wall, mid-height.
NodeField inflation(const HermiteMesh& mesh, double inner_mm);

struct TaggedOptions {
  size_t tags_a_frame = 600;
  double sigma_mm = 0.3;    ///< stated
  double noise = 1.0;       ///< factor on the noise that is really there
  double wild_share = 0.0;  ///< of the points, moved by up to 15 mm along the normal
  bool along_axis = true;   ///< whether long-axis slices, which see motion along z, are there
  std::vector<int> frames = {0, 1, 2, 3, 4};  ///< that have tags
  unsigned seed = 1;
};

/// Frame 0 and loaded frames 1..4 at 0.25..1 of `inner_mm`, pressures in proportion. Slices as in the scanner: six short-axis ones
/// (normals (1, ±1, 0)/√2) and six long-axis ones (normals (e ± z)/√2).
Measurement tagged_inflation(const HermiteMesh& mesh, double inner_mm, const TaggedOptions& options);

}  // namespace diastole::test
