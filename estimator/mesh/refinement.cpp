#include "estimator/mesh/refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>
#include <string>
#include <utility>

namespace diastole {
namespace {

constexpr double proportion_slack = 1e-9;

/// The dof that stands for each dof; `no_dof` for those that are always zero.
constexpr size_t no_dof = static_cast<size_t>(-1);

std::vector<size_t> hosts_of(const HermiteMesh& mesh) {
  std::vector<size_t> hosts(mesh.node_count() * dofs_per_node);
  for (size_t dof = 0; dof < hosts.size(); ++dof)
    hosts[dof] = dof;
  for (const auto& [dof, host] : mesh.ties().same)
    hosts[dof] = host;
  for (const size_t dof : mesh.ties().zero)
    hosts[dof] = no_dof;
  for (const auto& [dof, host] : mesh.ties().same) {
    if (hosts[host] == no_dof) hosts[dof] = no_dof;
  }
  return hosts;
}

[[noreturn]] void refuse(size_t element, const std::string& why) {
  throw std::invalid_argument("element " + std::to_string(element) + " cannot be halved: " + why);
}

}  // namespace

struct Refinement::Numbering {
  std::vector<HermiteMesh::Corners> elements;
  std::vector<HermiteMesh::Scales> scales;  // empty if all are one
};

Refinement::Numbering Refinement::number(const HermiteMesh& coarse) {
  const size_t bit = size_t{1} << direction_;
  std::map<std::pair<size_t, size_t>, size_t> known;  // midpoint of two nodes
  Numbering numbering;
  bool all_one = true;
  for (size_t e = 0; e < coarse.element_count(); ++e) {
    std::array<HermiteMesh::Corners, 2> children{coarse.element(e), coarse.element(e)};
    std::array<HermiteMesh::Scales, 2> scales{};
    for (size_t a = 0; a < hermite_functions; ++a)
      scales[0][a] = scales[1][a] = coarse.scale(e, a);
    for (size_t low = 0; low < corners; ++low) {
      if ((low & bit) != 0) continue;
      const size_t high = low | bit;
      Midpoint here{coarse.element(e)[low], coarse.element(e)[high], {}, {}};
      if (here.low == here.high) refuse(e, "one node is at both ends of an edge");
      for (size_t d = 0; d < nodal_derivatives; ++d) {
        here.low_scale[d] = coarse.scale(e, hermite_function(low, d));
        here.high_scale[d] = coarse.scale(e, hermite_function(high, d));
      }
      const auto [place, is_new] = known.try_emplace({here.low, here.high}, midpoints_.size());
      if (is_new) midpoints_.push_back(here);
      const Midpoint& first = midpoints_[place->second];
      children[0][high] = children[1][low] = coarse_nodes_ + place->second;
      for (size_t d = 0; d < nodal_derivatives; ++d) {
        const size_t plain = d & ~bit;
        const double proportion = here.low_scale[plain] / first.low_scale[plain];
        for (const size_t other : {plain, plain | bit}) {
          if (std::abs(here.low_scale[other] - proportion * first.low_scale[other]) >
                  proportion_slack * std::abs(here.low_scale[other]) ||
              std::abs(here.high_scale[other] - proportion * first.high_scale[other]) >
                  proportion_slack * std::abs(here.high_scale[other]))
            refuse(e, "its scale factors along an edge are in another proportion than its neighbour's");
        }
        scales[0][hermite_function(high, d)] = scales[1][hermite_function(low, d)] = proportion;
      }
    }
    for (size_t side = 0; side < 2; ++side) {
      numbering.elements.push_back(children[side]);
      numbering.scales.push_back(scales[side]);
      all_one =
          all_one && std::all_of(scales[side].begin(), scales[side].end(), [](double s) { return s == 1.0; });
    }
  }
  if (all_one) numbering.scales.clear();
  return numbering;
}

MeshFaces Refinement::faces(const MeshFaces& coarse) const {
  MeshFaces finer;
  for (const auto list : {&MeshFaces::inner, &MeshFaces::outer, &MeshFaces::bottom, &MeshFaces::top,
                          &MeshFaces::left, &MeshFaces::right}) {
    for (const ElementFace& face : coarse.*list) {
      for (size_t child = 0; child < 2; ++child) {
        if (face.direction != direction_ || face.side == child)
          (finer.*list).push_back({2 * face.element + child, face.direction, face.side});
      }
    }
  }
  return finer;
}

DofTies Refinement::ties(const HermiteMesh& coarse) const {
  const size_t bit = size_t{1} << direction_;
  const std::vector<size_t> hosts = hosts_of(coarse);
  DofTies ties = coarse.ties();
  // A new dof depends on four old ones; two new dofs that depend on the same four are one. The last entry separates
  // value (0) from derivative along the edge (1).
  std::map<std::array<size_t, 5>, size_t> known;
  for (size_t m = 0; m < midpoints_.size(); ++m) {
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      for (size_t i = 0; i < 3; ++i) {
        const size_t plain = d & ~bit;
        const size_t along = (d & bit) != 0 ? 1 : 0;
        const auto host = [&](size_t node, size_t derivative) { return hosts[dof_of(node, derivative, i)]; };
        const std::array<size_t, 5> sources{host(midpoints_[m].low, plain), host(midpoints_[m].high, plain),
                                            host(midpoints_[m].low, plain | bit),
                                            host(midpoints_[m].high, plain | bit), along};
        const size_t dof = dof_of(coarse_nodes_ + m, d, i);
        const bool constant = sources[0] == sources[1] && sources[2] == no_dof && sources[3] == no_dof;
        if (constant && (along == 1 || sources[0] == no_dof)) {
          ties.zero.push_back(dof);
        } else if (constant) {
          ties.same.emplace_back(dof, sources[0]);
        } else {
          const auto [first, is_new] = known.try_emplace(sources, dof);
          if (!is_new) ties.same.emplace_back(dof, first->second);
        }
      }
    }
  }
  return ties;
}

NodeField Refinement::prolonged(std::span<const double> field) const {
  const size_t bit = size_t{1} << direction_;
  NodeField finer(field.begin(), field.end());
  for (size_t dof = 0; dof < finer.size(); ++dof) {
    if ((dof % dofs_per_node / 3 & bit) != 0) finer[dof] *= 0.5;
  }
  finer.resize((coarse_nodes_ + midpoints_.size()) * dofs_per_node);
  for (size_t m = 0; m < midpoints_.size(); ++m) {
    const Midpoint& middle = midpoints_[m];
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      if ((d & bit) != 0) continue;
      for (size_t i = 0; i < 3; ++i) {
        const double low = middle.low_scale[d] * field[dof_of(middle.low, d, i)];
        const double high = middle.high_scale[d] * field[dof_of(middle.high, d, i)];
        const double low_slope = middle.low_scale[d | bit] * field[dof_of(middle.low, d | bit, i)];
        const double high_slope = middle.high_scale[d | bit] * field[dof_of(middle.high, d | bit, i)];
        finer[dof_of(coarse_nodes_ + m, d, i)] = 0.5 * (low + high) + 0.125 * (low_slope - high_slope);
        finer[dof_of(coarse_nodes_ + m, d | bit, i)] = 0.75 * (high - low) - 0.125 * (low_slope + high_slope);
      }
    }
  }
  return finer;
}

std::vector<double> Refinement::prolonged_corners(std::span<const double> values) const {
  std::vector<double> finer(values.begin(), values.end());
  for (const Midpoint& middle : midpoints_)
    finer.push_back(0.5 * (values[middle.low] + values[middle.high]));
  return finer;
}

Refinement::Refinement(const HermiteMesh& coarse, size_t direction)
    : direction_(direction), coarse_nodes_(coarse.node_count()), mesh_(coarse) {
  Numbering numbering = number(coarse);
  mesh_ = HermiteMesh(prolonged(coarse.reference()), std::move(numbering.elements), faces(coarse.faces()),
                      std::move(numbering.scales), ties(coarse));
}

}  // namespace diastole
