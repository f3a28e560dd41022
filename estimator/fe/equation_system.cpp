#include "estimator/fe/equation_system.hpp"

#include <algorithm>
#include <map>
#include <utility>

namespace diastole {
namespace {

using Eigen::Index;

constexpr size_t triangle(size_t row) { return row * (row + 1) / 2; }

}  // namespace

EquationSystem::EquationSystem(const HermiteMesh& mesh, const HeldDofs& held, const PressureMap& pressures)
    : pressure_unknowns_(pressures.count) {
  number_equations(mesh, held);
  map_elements(mesh, pressures);
  colour_elements(mesh);
}

void EquationSystem::number_equations(const HermiteMesh& mesh, const HeldDofs& held) {
  equation_of_dof_.assign(held.size(), none);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    first_equation_.push_back(displacement_unknowns_);
    for (size_t dof = node * dofs_per_node; dof < (node + 1) * dofs_per_node; ++dof) {
      if (held[dof] == 0) equation_of_dof_[dof] = displacement_unknowns_++;
    }
    free_dofs_.push_back(displacement_unknowns_ - first_equation_.back());
  }
}

size_t EquationSystem::make_node_block(size_t high_node, size_t low_node) {
  const size_t start = rows_.size();
  for (size_t r = 0; r < free_dofs_[high_node]; ++r) {
    const size_t count = high_node == low_node ? r + 1 : free_dofs_[low_node];
    for (size_t c = 0; c < count; ++c) {
      rows_.push_back(static_cast<int>(first_equation_[high_node] + r + 1));
      columns_.push_back(static_cast<int>(first_equation_[low_node] + c + 1));
    }
  }
  return start;
}

size_t EquationSystem::make_pressure_piece(size_t pressure, size_t node) {
  const size_t start = rows_.size();
  for (size_t c = 0; c < free_dofs_[node]; ++c) {
    rows_.push_back(static_cast<int>(displacement_unknowns_ + pressure + 1));
    columns_.push_back(static_cast<int>(first_equation_[node] + c + 1));
  }
  return start;
}

void EquationSystem::map_elements(const HermiteMesh& mesh, const PressureMap& pressures) {
  std::map<std::pair<size_t, size_t>, size_t> node_blocks;
  std::map<std::pair<size_t, size_t>, size_t> pressure_pieces;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    const HermiteMesh::Corners& nodes = mesh.element(e);
    ElementMap map;
    map.nodes = nodes;
    for (size_t a = 0; a < hermite_functions; ++a) {
      map.scale[a] = mesh.scale(e, a);
      const size_t node = nodes[hermite_corner(a)];
      for (size_t i = 0; i < 3; ++i) {
        const size_t found = equation_of_dof_[dof_of(node, hermite_derivative(a), i)];
        map.equation[3 * a + i] = found;
        map.within_node[3 * a + i] = found == none ? none : found - first_equation_[node];
      }
    }
    for (size_t c = 0; c < corners; ++c) {
      map.free_dofs[c] = free_dofs_[nodes[c]];
      for (size_t d = 0; d < corners; ++d) {
        const std::pair pair{std::max(nodes[c], nodes[d]), std::min(nodes[c], nodes[d])};
        const auto [block, is_new] = node_blocks.try_emplace(pair, 0);
        if (is_new) block->second = make_node_block(pair.first, pair.second);
        map.node_block[c * corners + d] = block->second;
        const auto [piece, is_new_piece] =
            pressure_pieces.try_emplace({pressures.unknown[e][c], nodes[d]}, 0);
        if (is_new_piece) piece->second = make_pressure_piece(pressures.unknown[e][c], nodes[d]);
        map.pressure_piece[c * corners + d] = piece->second;
      }
    }
    maps_.push_back(map);
  }
}

void EquationSystem::colour_elements(const HermiteMesh& mesh) {
  std::vector<std::vector<size_t>> colours_of_node(mesh.node_count());
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    size_t colour = 0;
    const auto taken = [&](size_t candidate) {
      return std::any_of(mesh.element(e).begin(), mesh.element(e).end(), [&](size_t node) {
        return std::find(colours_of_node[node].begin(), colours_of_node[node].end(), candidate) !=
               colours_of_node[node].end();
      });
    };
    while (taken(colour))
      ++colour;
    for (const size_t node : mesh.element(e))
      colours_of_node[node].push_back(colour);
    if (colour == colours_.size()) colours_.emplace_back();
    colours_[colour].push_back(e);
  }
}

size_t EquationSystem::entry(const ElementMap& map, size_t dof, size_t other_dof) {
  size_t high = map.within_node[dof];
  size_t low = map.within_node[other_dof];
  if (high == none || low == none) return none;
  const size_t corner = hermite_corner(dof / 3);
  const size_t other_corner = hermite_corner(other_dof / 3);
  const size_t start = map.node_block[corner * corners + other_corner];
  if (corner == other_corner) return start + triangle(std::max(high, low)) + std::min(high, low);
  if (map.nodes[corner] > map.nodes[other_corner]) return start + high * map.free_dofs[other_corner] + low;
  return start + low * map.free_dofs[corner] + high;
}

void EquationSystem::add_tangent(size_t element, const ElementTangent& tangent,
                                 std::span<double> values) const {
  const ElementMap& map = maps_[element];
  for (size_t a = 0; a < hermite_functions; ++a) {
    for (size_t b = a; b < hermite_functions; ++b) {
      const double scale = map.scale[a] * map.scale[b];
      for (size_t i = 0; i < 3; ++i) {
        for (size_t k = a == b ? i : 0; k < 3; ++k) {
          const size_t place = entry(map, 3 * a + i, 3 * b + k);
          if (place != none) values[place] += scale * tangent.stiffness.entry(a, i, b, k);
        }
      }
    }
  }
  for (size_t m = 0; m < corners; ++m) {
    for (size_t a = 0; a < hermite_functions; ++a) {
      const size_t start = map.pressure_piece[m * corners + hermite_corner(a)];
      for (size_t i = 0; i < 3; ++i) {
        const size_t place = map.within_node[3 * a + i];
        if (place == none) continue;
        values[start + place] +=
            map.scale[a] * tangent.coupling[m](static_cast<Index>(i), static_cast<Index>(a));
      }
    }
  }
}

void EquationSystem::add_force(size_t element, const ElementField& force,
                               std::span<double> right_side) const {
  const ElementMap& map = maps_[element];
  for (size_t a = 0; a < hermite_functions; ++a) {
    for (size_t i = 0; i < 3; ++i) {
      const size_t equation = map.equation[3 * a + i];
      if (equation == none) continue;
      right_side[equation] += map.scale[a] * force(static_cast<Index>(i), static_cast<Index>(a));
    }
  }
}

void EquationSystem::add_face_tangent(size_t element, std::span<const size_t> functions,
                                      const Eigen::Ref<const Eigen::MatrixXd>& matrix, double factor,
                                      std::span<double> values) const {
  const ElementMap& map = maps_[element];
  const size_t count = 3 * functions.size();
  for (size_t r = 0; r < count; ++r) {
    const size_t a = functions[r / 3];
    for (size_t c = 0; c <= r; ++c) {
      const size_t b = functions[c / 3];
      const size_t place = entry(map, 3 * a + r % 3, 3 * b + c % 3);
      if (place == none) continue;
      values[place] +=
          factor * map.scale[a] * map.scale[b] * matrix(static_cast<Index>(r), static_cast<Index>(c));
    }
  }
}

}  // namespace diastole
