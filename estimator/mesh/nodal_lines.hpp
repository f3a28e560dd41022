#pragma once
// The lines that a mesh's edges make along each xi: who follows whom, how smooth a nodal field is along them, how deep a node lies.

#include <array>
#include <cstddef>
#include <optional>
#include <vector>

#include "estimator/mesh/hermite_mesh.hpp"

namespace diastole {

class NodalLines {
 public:
  explicit NodalLines(const HermiteMesh& mesh);

  /// The next node along xi_direction; nothing at the end of a line.
  [[nodiscard]] std::optional<size_t> after(size_t node, size_t direction) const;
  [[nodiscard]] std::optional<size_t> before(size_t node, size_t direction) const;

  /// f(before) - 2 f(node) + f(after): three nodes in a row.
  struct SecondDifference {
    std::array<size_t, 3> nodes;  ///< before, node, after
    size_t direction;
  };
  [[nodiscard]] std::vector<SecondDifference> second_differences() const;

  /// Where each node lies on its line along xi3: 0 at its beginning (the inside of a wall), 1 at its end.
  [[nodiscard]] std::vector<double> depths() const;

 private:
  static constexpr size_t none = static_cast<size_t>(-1);
  std::array<std::vector<size_t>, 3> after_, before_;
};

/// A value of each node between them, trilinear.
double between_nodes(const HermiteMesh& mesh, const std::vector<double>& nodal, const MaterialPoint& point);

}  // namespace diastole
