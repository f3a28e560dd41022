#include "estimator/imaging/geometry/wall_outline.hpp"

#include <numbers>

#include "estimator/imaging/geometry/wall_map.hpp"

namespace diastole::imaging {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Where a plane goes through a triangle; `above` are its corners' distances from the plane.
void cut_triangle(const std::array<Vector3d, 3>& corners, const std::array<double, 3>& above,
                  const SlicePlane& plane, std::vector<Segment>& pieces) {
  Segment piece;
  size_t ends = 0;
  for (size_t a = 0; a < 3 && ends < 2; ++a) {
    const size_t b = (a + 1) % 3;
    if ((above[a] < 0) == (above[b] < 0)) continue;
    const double part = above[a] / (above[a] - above[b]);
    piece[ends++] = plane.in_plane_mm(corners[a] + part * (corners[b] - corners[a]));
  }
  if (ends == 2) pieces.push_back(piece);
}

}  // namespace

WallNet wall_net(const ProlateFrame& frame, const VentricleWalls& walls, double side) {
  const WallMap map(frame, walls);
  WallNet net;
  net.places_mm.resize(3, WallNet::around * WallNet::along);
  for (Index i = 0; i < WallNet::around; ++i) {
    const double theta = 2 * std::numbers::pi * static_cast<double>(i) / WallNet::around;
    const double base_mu = map.base_mu(side, theta);
    for (Index j = 0; j < WallNet::along; ++j) {
      const double part = static_cast<double>(j) / (WallNet::along - 1);
      net.places_mm.col(WallNet::along * i + j) = frame.patient(map.place_mm(side, theta, part * base_mu));
    }
  }
  return net;
}

std::vector<Segment> wall_outline(const WallNet& net, const SlicePlane& plane, const Vector3d& shift_mm) {
  const Vector3d normal = plane.normal();
  std::vector<Segment> pieces;
  const auto cut = [&](const std::array<Index, 3>& nodes) {
    std::array<Vector3d, 3> corners;
    std::array<double, 3> above{};
    for (size_t k = 0; k < 3; ++k) {
      corners[k] = net.places_mm.col(nodes[k]) + shift_mm;
      above[k] = normal.dot(corners[k] - plane.origin_mm);
    }
    cut_triangle(corners, above, plane, pieces);
  };
  for (Index i = 0; i < WallNet::around; ++i) {
    const Index here = WallNet::along * i, next = WallNet::along * ((i + 1) % WallNet::around);
    for (Index j = 0; j + 1 < WallNet::along; ++j) {
      cut({here + j, next + j, next + j + 1});
      cut({here + j, next + j + 1, here + j + 1});
    }
  }
  return pieces;
}

}  // namespace diastole::imaging
