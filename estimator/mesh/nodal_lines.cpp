#include "estimator/mesh/nodal_lines.hpp"

namespace diastole {

NodalLines::NodalLines(const HermiteMesh& mesh) {
  for (size_t direction = 0; direction < 3; ++direction) {
    after_[direction].assign(mesh.node_count(), none);
    before_[direction].assign(mesh.node_count(), none);
    const size_t bit = size_t{1} << direction;
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      for (size_t low = 0; low < corners; ++low) {
        if ((low & bit) != 0) continue;
        after_[direction][mesh.element(e)[low]] = mesh.element(e)[low | bit];
        before_[direction][mesh.element(e)[low | bit]] = mesh.element(e)[low];
      }
    }
  }
}

std::optional<size_t> NodalLines::after(size_t node, size_t direction) const {
  const size_t other = after_[direction][node];
  return other == none ? std::nullopt : std::optional(other);
}

std::optional<size_t> NodalLines::before(size_t node, size_t direction) const {
  const size_t other = before_[direction][node];
  return other == none ? std::nullopt : std::optional(other);
}

std::vector<NodalLines::SecondDifference> NodalLines::second_differences() const {
  std::vector<SecondDifference> differences;
  for (size_t direction = 0; direction < 3; ++direction) {
    for (size_t node = 0; node < after_[direction].size(); ++node) {
      const auto low = before(node, direction), high = after(node, direction);
      if (low && high) differences.push_back({{*low, node, *high}, direction});
    }
  }
  return differences;
}

std::vector<double> NodalLines::depths() const {
  std::vector<double> depths(after_[2].size(), 0.0);
  for (size_t node = 0; node < depths.size(); ++node) {
    if (before(node, 2)) continue;
    std::vector<size_t> line{node};
    for (auto next = after(node, 2); next && line.size() <= depths.size(); next = after(*next, 2))
      line.push_back(*next);
    for (size_t i = 1; i < line.size(); ++i)
      depths[line[i]] = static_cast<double>(i) / static_cast<double>(line.size() - 1);
  }
  return depths;
}

double between_nodes(const HermiteMesh& mesh, const std::vector<double>& nodal, const MaterialPoint& point) {
  const std::array<double, corners> basis = trilinear_basis(point.xi);
  double sum = 0.0;
  for (size_t c = 0; c < corners; ++c)
    sum += basis[c] * nodal[mesh.element(point.element)[c]];
  return sum;
}

}  // namespace diastole
