#include "estimator/fe/equation_system.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

namespace diastole {
namespace {

using Eigen::Index;

constexpr size_t triangle(size_t row) { return row * (row + 1) / 2; }

}  // namespace

PressureMap make_pressure_map(const HermiteMesh& mesh, PressureSpace space) {
  PressureMap map;
  std::map<std::pair<size_t, size_t>, size_t> unknowns;  // of an element (0 if continuous) and a place
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    std::array<size_t, corners> unknown;
    for (size_t c = 0; c < corners; ++c) {
      const size_t owner = space == PressureSpace::continuous ? 0 : e;
      const size_t place = mesh.place_of(mesh.element(e)[c]);
      unknown[c] = unknowns.try_emplace({owner, place}, unknowns.size()).first->second;
    }
    map.unknown.push_back(unknown);
  }
  map.count = unknowns.size();
  return map;
}

EquationSystem::EquationSystem(const HermiteMesh& mesh, const HeldDofs& held, const PressureMap& pressures,
                               const EquationOptions& options)
    : pressure_unknowns_(pressures.count) {
  number_equations(mesh, held);
  map_elements(mesh, pressures);
  colour_elements();
  if (options.compressible) map_compliance(pressures);
  all_unknowns_ = displacement_unknowns_ + pressure_unknowns_;
  for (const std::vector<ElementFace>& surface : options.fluids)
    add_fluid_row(surface);
}

void EquationSystem::number_equations(const HermiteMesh& mesh, const HeldDofs& held) {
  equation_of_dof_.assign(held.size(), none);
  host_of_dof_.resize(held.size());
  std::vector<unsigned char> has_own(held.size());
  for (size_t dof = 0; dof < held.size(); ++dof) {
    host_of_dof_[dof] = dof / dofs_per_node;
    has_own[dof] = held[dof] == 0;
  }
  for (const auto& [dof, other] : mesh.ties().same)
    has_own[dof] = 0;
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    first_equation_.push_back(displacement_unknowns_);
    for (size_t dof = node * dofs_per_node; dof < (node + 1) * dofs_per_node; ++dof) {
      if (has_own[dof] != 0) equation_of_dof_[dof] = displacement_unknowns_++;
    }
    free_dofs_.push_back(displacement_unknowns_ - first_equation_.back());
  }
  for (const auto& [dof, other] : mesh.ties().same) {
    equation_of_dof_[dof] = equation_of_dof_[other];
    host_of_dof_[dof] = other / dofs_per_node;
  }
}

size_t EquationSystem::make_node_block(size_t high_node, size_t low_node) {
  const size_t start = rows_.size();
  for (size_t r = 0; r < free_dofs_[high_node]; ++r) {
    const size_t count = high_node == low_node ? r + 1 : free_dofs_[low_node];
    for (size_t c = 0; c < count; ++c)
      add_entry(first_equation_[high_node] + r, first_equation_[low_node] + c);
  }
  return start;
}

size_t EquationSystem::make_pressure_piece(size_t pressure, size_t node) {
  const size_t start = rows_.size();
  for (size_t c = 0; c < free_dofs_[node]; ++c)
    add_entry(displacement_unknowns_ + pressure, first_equation_[node] + c);
  return start;
}

EquationSystem::ElementMap EquationSystem::map_dofs(const HermiteMesh& mesh, size_t element) const {
  ElementMap map;
  const HermiteMesh::Corners& nodes = mesh.element(element);
  std::copy(nodes.begin(), nodes.end(), map.nodes.begin());
  for (size_t a = 0; a < hermite_functions; ++a) {
    map.scale[a] = mesh.scale(element, a);
    for (size_t i = 0; i < 3; ++i) {
      const size_t dof = dof_of(nodes[hermite_corner(a)], hermite_derivative(a), i);
      const size_t host_node = host_of_dof_[dof];
      const auto known = map.nodes.begin() + static_cast<std::ptrdiff_t>(map.hosts);
      const auto host = std::find(map.nodes.begin(), known, host_node);
      if (host == known) map.nodes[map.hosts++] = host_node;
      const size_t found = equation_of_dof_[dof];
      map.host[3 * a + i] = static_cast<size_t>(host - map.nodes.begin());
      map.equation[3 * a + i] = found;
      map.within_node[3 * a + i] = found == none ? none : found - first_equation_[host_node];
    }
  }
  for (size_t h = 0; h < map.hosts; ++h)
    map.free_dofs[h] = free_dofs_[map.nodes[h]];
  return map;
}

void EquationSystem::map_elements(const HermiteMesh& mesh, const PressureMap& pressures) {
  std::map<std::pair<size_t, size_t>, size_t> node_blocks;
  std::map<std::pair<size_t, size_t>, size_t> pressure_pieces;
  for (size_t e = 0; e < mesh.element_count(); ++e) {
    ElementMap map = map_dofs(mesh, e);
    for (size_t g = 0; g < map.hosts; ++g) {
      for (size_t h = 0; h < map.hosts; ++h) {
        const std::pair pair{std::max(map.nodes[g], map.nodes[h]), std::min(map.nodes[g], map.nodes[h])};
        const auto [block, is_new] = node_blocks.try_emplace(pair, 0);
        if (is_new) block->second = make_node_block(pair.first, pair.second);
        map.node_block[g * most_hosts + h] = block->second;
      }
      for (size_t m = 0; m < corners; ++m) {
        const size_t unknown = pressures.unknown[e][m];
        const auto [piece, is_new] = pressure_pieces.try_emplace({unknown, map.nodes[g]}, 0);
        if (is_new) piece->second = make_pressure_piece(unknown, map.nodes[g]);
        map.pressure_piece[m * most_hosts + g] = piece->second;
      }
    }
    maps_.push_back(map);
  }
}

void EquationSystem::colour_elements() {
  std::vector<std::vector<size_t>> colours_of_node(first_equation_.size());
  for (size_t e = 0; e < maps_.size(); ++e) {
    const std::span nodes(maps_[e].nodes.data(), maps_[e].hosts);
    size_t colour = 0;
    const auto is_used = [&](size_t candidate) {
      return std::any_of(nodes.begin(), nodes.end(), [&](size_t node) {
        return std::find(colours_of_node[node].begin(), colours_of_node[node].end(), candidate) !=
               colours_of_node[node].end();
      });
    };
    while (is_used(colour))
      ++colour;
    for (const size_t node : nodes)
      colours_of_node[node].push_back(colour);
    if (colour == colours_.size()) colours_.emplace_back();
    colours_[colour].push_back(e);
  }
}

void EquationSystem::map_compliance(const PressureMap& pressures) {
  std::map<std::pair<size_t, size_t>, size_t> known;
  for (size_t e = 0; e < maps_.size(); ++e) {
    for (size_t m = 0; m < corners; ++m) {
      for (size_t n = 0; n <= m; ++n) {
        const auto [low, high] = std::minmax({pressures.unknown[e][m], pressures.unknown[e][n]});
        const auto [place, is_new] = known.try_emplace({high, low}, rows_.size());
        if (is_new) add_entry(displacement_unknowns_ + high, displacement_unknowns_ + low);
        maps_[e].compliance[triangle(m) + n] = place->second;
      }
    }
  }
}

void EquationSystem::add_fluid_row(const std::vector<ElementFace>& surface) {
  std::set<size_t> met;
  for (const ElementFace& face : surface) {
    for (const size_t a : face_hermite_functions(face)) {
      for (size_t i = 0; i < 3; ++i)
        met.insert(equation(face.element, a, i));
    }
  }
  met.erase(none);
  const FluidRow& row =
      fluid_rows_.emplace_back(FluidRow{all_unknowns_++, rows_.size(), {met.begin(), met.end()}});
  for (const size_t column : row.columns)
    add_entry(row.unknown, column);
  add_entry(row.unknown, row.unknown);
}

size_t EquationSystem::entry(const ElementMap& map, size_t dof, size_t other_dof) {
  size_t high = map.within_node[dof];
  size_t low = map.within_node[other_dof];
  if (high == none || low == none) return none;
  const size_t host = map.host[dof];
  const size_t other_host = map.host[other_dof];
  const size_t start = map.node_block[host * most_hosts + other_host];
  if (host == other_host) return start + triangle(std::max(high, low)) + std::min(high, low);
  if (map.nodes[host] > map.nodes[other_host]) return start + high * map.free_dofs[other_host] + low;
  return start + low * map.free_dofs[host] + high;
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
          if (place == none) continue;
          values[place] +=
              multiplicity(map, 3 * a + i, 3 * b + k) * scale * tangent.stiffness.entry(a, i, b, k);
        }
      }
    }
  }
  for (size_t m = 0; m < corners; ++m) {
    for (size_t a = 0; a < hermite_functions; ++a) {
      for (size_t i = 0; i < 3; ++i) {
        const size_t place = map.within_node[3 * a + i];
        if (place == none) continue;
        values[map.pressure_piece[m * most_hosts + map.host[3 * a + i]] + place] +=
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

void EquationSystem::add_compliance(size_t element, const Eigen::Matrix<double, corners, corners>& matrix,
                                    std::span<double> values) const {
  const ElementMap& map = maps_[element];
  for (size_t m = 0; m < corners; ++m) {
    for (size_t n = 0; n <= m; ++n) {
      // Two corners of one element that share a pressure (a collapsed edge) meet twice in its diagonal.
      const size_t place = map.compliance[triangle(m) + n];
      const bool shared = m != n && rows_[place] == columns_[place];
      values[place] += (shared ? 2.0 : 1.0) * matrix(static_cast<Index>(m), static_cast<Index>(n));
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
      values[place] += multiplicity(map, 3 * a + r % 3, 3 * b + c % 3) * factor * map.scale[a] *
                       map.scale[b] * matrix(static_cast<Index>(r), static_cast<Index>(c));
    }
  }
}

}  // namespace diastole
