#pragma once
// What lies where in a slice while the specimen is deformed: its tissue with the place that it came from, fluid in the cavity, the bath
// around it, or nothing (plates, air).
//
// The finite-element motion is inverted at the nodes of a lattice through the slice, and interpolated between them: to a
// thousandth of a millimetre for motions that bend over centimetres.

#include <Eigen/Dense>
#include <array>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"
#include "tools/sim_scanner/scan_protocol.hpp"

namespace diastole::scanner {

enum class Medium : unsigned char { tissue, cavity, bath, nothing };

struct Spot {
  Medium medium;
  Eigen::Vector3d X_mm;  ///< of tissue: where it was undeformed
};

class SliceOfBody {
 public:
  /// `position_mm`: of the mesh's nodes, deformed. `extent_mm` within the plane, `thickness_mm` across it.
  SliceOfBody(const HermiteMesh& mesh, const NodeField& position_mm, const ScanPlane& plane, double extent_mm,
              double thickness_mm);

  /// At distances along row, column and normal from the plane's first pixel, inside the extent.
  [[nodiscard]] Spot at(const Eigen::Vector3d& within_mm) const;

 private:
  struct Node {
    Eigen::Vector3d X_mm = Eigen::Vector3d::Zero();
    double outside_mm = 0;            ///< of the tissue; negative inside
    Medium beyond = Medium::nothing;  ///< what is there if it is not tissue
    bool known = false;
    bool tried = false;
  };
  /// The cylinder of water around the undeformed body, between its ends.
  struct Bath {
    double radius_mm = 0, low_mm = 1e300, high_mm = -1e300;
    explicit Bath(const HermiteMesh& mesh);
    [[nodiscard]] bool holds(const Eigen::Vector3d& x_mm, double beyond_ends_mm = 0) const;
  };
  using Place = std::array<Eigen::Index, 3>;  // column, row, layer
  [[nodiscard]] size_t index(const Place& at) const {
    return static_cast<size_t>((at[2] * across_ + at[1]) * across_ + at[0]);
  }
  template <class Visit>
  void each_place(const Visit& visit) const;
  template <class Visit>
  void each_neighbour(const Place& of, const Visit& visit) const;
  void fill_unknown();
  [[nodiscard]] Eigen::Vector3d place_mm(const Eigen::Vector3d& within_mm) const;

  ScanPlane plane_;
  Bath bath_;
  Eigen::Index across_;
  Eigen::Index layers_;
  Eigen::Vector3d first_mm_;
  Eigen::Vector3d step_mm_;
  std::vector<Node> nodes_;
};

}  // namespace diastole::scanner
