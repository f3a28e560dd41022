#include "estimator/fe/fluid_surface.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace diastole {
namespace {

using Eigen::Index;
using Ends = std::pair<size_t, size_t>;

Ends ends_of(const HermiteMesh& mesh, const FaceEdge& edge) {
  const auto [from, to] = edge_corners(edge);
  const HermiteMesh::Corners& nodes = mesh.element(edge.face.element);
  return std::minmax({mesh.place_of(nodes[from]), mesh.place_of(nodes[to])});
}

std::map<Ends, size_t> count_edges(const HermiteMesh& mesh, std::span<const ElementFace> faces) {
  std::map<Ends, size_t> count;
  for (const ElementFace& face : faces) {
    for (size_t edge = 0; edge < 4; ++edge)
      ++count[ends_of(mesh, {face, edge})];
  }
  return count;
}

/// Whether (v x u) . x' vanishes on the edge for all motions that are left to it: one component at most is free, or
/// the edge stays in a plane across the third.
bool harmless(const HermiteMesh& mesh, const FaceEdge& edge, const HeldDofs& held) {
  const HermiteMesh::Corners& nodes = mesh.element(edge.face.element);
  const ElementField reference = mesh.gather(edge.face.element, mesh.reference());
  const auto functions = edge_hermite_functions(edge);
  size_t held_components = 0;
  bool in_plane = false;
  for (size_t i = 0; i < 3; ++i) {
    const bool all_held = std::all_of(functions.begin(), functions.end(), [&](size_t a) {
      return held[dof_of(nodes[hermite_corner(a)], hermite_derivative(a), i)] != 0;
    });
    if (!all_held) continue;
    ++held_components;
    const auto at = [&](size_t a) {
      return reference(static_cast<Index>(i), static_cast<Index>(functions[a]));
    };
    const double slack_mm = 1e-9 * mesh.extent_mm();
    in_plane |=
        std::abs(at(0) - at(2)) < slack_mm && std::abs(at(1)) < slack_mm && std::abs(at(3)) < slack_mm;
  }
  return held_components >= 2 || in_plane;
}

/// Adds values over an edge's functions to those of its face.
template <class Visit>
void for_edge_functions(const FaceEdge& edge, const Visit& visit) {
  const auto of_face = face_hermite_functions(edge.face);
  const auto of_edge = edge_hermite_functions(edge);
  for (size_t a = 0; a < edge_functions; ++a) {
    const auto place = std::find(of_face.begin(), of_face.end(), of_edge[a]) - of_face.begin();
    visit(static_cast<Index>(a), static_cast<Index>(place));
  }
}

/// What the lid over a rim in one plane adds to the wall's half flux of (x, y, 0), which is the volume if lids lie across z: the
/// wall's third of the flux of x - p, p on the plane, counts all of it. Zero where the rim lies across z, or in no one plane.
double lid_volume_mm3(const HermiteMesh& mesh, const std::vector<ElementFace>& faces,
                      const std::vector<Eigen::Vector3d>& rim) {
  if (rim.size() < 3) return 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  for (const Eigen::Vector3d& x : rim)
    centre += x / static_cast<double>(rim.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Eigen::Vector3d& x : rim)
    spread += (x - centre) * (x - centre).transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  const double slack_mm = 1e-6 * mesh.extent_mm();
  const Eigen::Vector3d normal = axes.eigenvectors().col(0);
  double off_plane_mm = 0, off_level_mm = 0;
  for (const Eigen::Vector3d& x : rim) {
    off_plane_mm = std::max(off_plane_mm, std::abs(normal.dot(x - centre)));
    off_level_mm = std::max(off_level_mm, std::abs(x.z() - centre.z()));
  }
  if (off_plane_mm > slack_mm || off_level_mm <= slack_mm) return 0;
  double whole = 0, without_lid = 0;
  for (const ElementFace& face : faces) {
    const ElementField reference = mesh.gather(face.element, mesh.reference());
    without_lid += face_volume_mm3(face, reference);
    for_each_face_point(face, reference, [&](const FacePoint& point) {
      whole += point.weight * (point.position - centre).dot(point.normal()) / 3;
    });
  }
  return whole - without_lid;
}

}  // namespace

double FluidFace::volume_mm3(const ElementField& position_mm) const {
  double volume = face_volume_mm3(face, position_mm);
  for (const Gap& gap : gaps)
    volume += gap_volume_mm3(gap.edge, gap.plate_z_mm, position_mm);
  return volume;
}

FaceField FluidFace::area_mm2(const ElementField& position_mm) const {
  FaceField area = face_area_mm2(face, position_mm);
  for (const Gap& gap : gaps) {
    const EdgeField strip = gap_area_mm2(gap.edge, gap.plate_z_mm, position_mm);
    for_edge_functions(gap.edge, [&](Index a, Index on_face) { area.col(on_face) += strip.col(a); });
  }
  return area;
}

FaceTangent FluidFace::tangent_mm(const ElementField& position_mm) const {
  FaceTangent tangent = face_tangent_mm(face, position_mm);
  for (const Gap& gap : gaps) {
    const EdgeTangent strip = gap_tangent_mm(gap.edge, gap.plate_z_mm, position_mm);
    for_edge_functions(gap.edge, [&](Index a, Index row) {
      for_edge_functions(gap.edge, [&](Index b, Index column) {
        tangent.block<3, 3>(3 * row, 3 * column) += strip.block<3, 3>(3 * a, 3 * b);
      });
    });
  }
  return tangent;
}

FluidSurface::FluidSurface(const HermiteMesh& mesh, const std::vector<ElementFace>& faces,
                           const HeldDofs& held, std::span<const ElementFace> plates) {
  const std::map<Ends, size_t> inside = count_edges(mesh, faces);
  const std::map<Ends, size_t> at_plates = count_edges(mesh, plates);
  std::vector<Eigen::Vector3d> held_rim;
  for (const ElementFace& face : faces) {
    FluidFace& added = faces_.emplace_back(FluidFace{face});
    for (size_t number = 0; number < 4; ++number) {
      const FaceEdge edge{face, number};
      const Ends ends = ends_of(mesh, edge);
      const bool rim = ends.first != ends.second && inside.at(ends) == 1;
      if (!rim) continue;
      if (harmless(mesh, edge, held)) {
        for (const size_t node : {ends.first, ends.second})
          held_rim.emplace_back(mesh.reference()[dof_of(node, 0, 0)], mesh.reference()[dof_of(node, 0, 1)],
                                mesh.reference()[dof_of(node, 0, 2)]);
        continue;
      }
      if (at_plates.contains(ends)) {
        added.gaps.push_back({edge, mesh.reference()[dof_of(ends.first, 0, 2)]});
      } else {
        free_rim_.push_back(edge);
      }
    }
  }
  if (closed()) lid_mm3_ = lid_volume_mm3(mesh, faces, held_rim);
}

double FluidSurface::volume_mm3(const HermiteMesh& mesh, const NodeField& position_mm) const {
  double volume = lid_mm3_;
  for (const FluidFace& face : faces_)
    volume += face.volume_mm3(mesh.gather(face.face.element, position_mm));
  return volume;
}

}  // namespace diastole
