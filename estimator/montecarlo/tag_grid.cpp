#include "estimator/montecarlo/tag_grid.hpp"

#include <cmath>

#include "estimator/mesh/point_locator.hpp"

namespace diastole {
namespace {

using Eigen::Vector3d;

struct Image {
  Vector3d origin_mm, across, up;
};

/// Corners of a box that holds the body, a tenth of it wider than its nodes: elements bulge between them.
struct Box {
  Vector3d low_mm, high_mm;

  explicit Box(const HermiteMesh& mesh) {
    low_mm = high_mm = Eigen::Map<const Vector3d>(&mesh.reference()[dof_of(0, 0, 0)]);
    for (size_t node = 1; node < mesh.node_count(); ++node) {
      const Eigen::Map<const Vector3d> place(&mesh.reference()[dof_of(node, 0, 0)]);
      low_mm = low_mm.cwiseMin(place);
      high_mm = high_mm.cwiseMax(place);
    }
  }
  [[nodiscard]] bool may_hold(const Vector3d& place) const {
    const Vector3d margin = 0.1 * (high_mm - low_mm);
    return ((place - low_mm + margin).array() >= 0).all() && ((high_mm + margin - place).array() >= 0).all();
  }
};

std::vector<Image> images_of(const Box& box, const TagGrid& grid) {
  std::vector<Image> images;
  const Vector3d x = Vector3d::UnitX(), y = Vector3d::UnitY(), z = Vector3d::UnitZ();
  for (int i = 0; i < grid.short_axis_images; ++i) {
    const double part = (i + 0.5) / grid.short_axis_images;
    images.push_back({(box.low_mm.z() + part * (box.high_mm.z() - box.low_mm.z())) * z, x, y});
  }
  for (int i = 0; i < grid.long_axis_images; ++i) {
    const double angle = M_PI * i / grid.long_axis_images;
    images.push_back(
        {(box.low_mm.z() + box.high_mm.z()) / 2 * z, std::cos(angle) * x + std::sin(angle) * y, z});
  }
  return images;
}

}  // namespace

std::vector<std::array<double, 3>> grid_places(const HermiteMesh& mesh, const TagGrid& grid) {
  const Box box(mesh);
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = 1e-9});
  const double reach_mm = (box.high_mm - box.low_mm).norm();
  const int stripes = static_cast<int>(reach_mm / grid.stripe_mm);
  const int pixels = static_cast<int>(reach_mm / grid.pixel_mm);
  std::vector<std::array<double, 3>> places;
  for (const Image& image : images_of(box, grid)) {
    for (const double side : {1.0, -1.0}) {
      const Vector3d along = std::sqrt(0.5) * (image.across + side * image.up);
      const Vector3d apart = std::sqrt(0.5) * (image.across - side * image.up);
      for (int stripe = -stripes; stripe < stripes; ++stripe) {
        for (int pixel = -pixels; pixel < pixels; ++pixel) {
          const Vector3d place = image.origin_mm + (stripe + 0.5) * grid.stripe_mm * apart +
                                 (pixel + 0.5) * grid.pixel_mm * along;
          if (box.may_hold(place) && locator.find(place)) places.push_back({place.x(), place.y(), place.z()});
        }
      }
    }
  }
  return places;
}

Measurement imaged_design(const HermiteMesh& mesh, const TagGrid& grid, const std::vector<Frame>& frames) {
  Measurement design;
  design.frames = frames;
  const std::vector<std::array<double, 3>> places = grid_places(mesh, grid);
  for (size_t frame = 1; frame < frames.size(); ++frame) {
    for (const auto& place : places)
      design.points.push_back({static_cast<int>(frame), place, place, grid.pixel_mm});
  }
  return design;
}

}  // namespace diastole
