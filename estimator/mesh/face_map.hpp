#pragma once
// Which faces of elements meet: those with the same four corner places, where coincident nodes count as one.

#include <algorithm>
#include <array>
#include <map>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

class FaceMap {
 public:
  explicit FaceMap(const HermiteMesh& mesh) : mesh_(mesh) {
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      for (size_t side = 0; side < 6; ++side) {
        const ElementFace face{e, side / 2, side % 2};
        meeting_[places_of(face)].push_back(face);
      }
    }
  }

  /// In the order of the elements, the face itself included.
  [[nodiscard]] const std::vector<ElementFace>& meeting(const ElementFace& face) const {
    return meeting_.at(places_of(face));
  }
  [[nodiscard]] bool is_outer(const ElementFace& face) const { return meeting(face).size() == 1; }

 private:
  [[nodiscard]] std::array<size_t, 4> places_of(const ElementFace& face) const {
    std::array<size_t, 4> places = face_corners(face);
    for (size_t& place : places)
      place = mesh_.place_of(mesh_.element(face.element)[place]);
    std::sort(places.begin(), places.end());
    return places;
  }

  const HermiteMesh& mesh_;
  std::map<std::array<size_t, 4>, std::vector<ElementFace>> meeting_;
};

}  // namespace diastole
