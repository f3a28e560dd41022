#include "estimator/montecarlo/synthetic_data.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimator/motion_residuals/motion_residuals.hpp"
#include "estimator/motion_residuals/tag_match.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

std::array<double, 3> array_of(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

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

Measurement exact_measurement(const HermiteMesh& mesh, const Measurement& design,
                              const std::vector<NodeField>& position_mm, const LocatorOptions& locator) {
  Measurement exact;
  exact.frames = design.frames;
  const PointLocator reference(mesh, mesh.reference(), locator);
  for (size_t number = 1; number < position_mm.size(); ++number) {
    if (position_mm[number].empty()) continue;
    const int frame = static_cast<int>(number);
    const PointLocator deformed(mesh, position_mm[number], locator);
    for (const TagPoint& tag : design.tags) {
      if (tag.frame != frame) continue;
      const auto guess = find_tag(deformed, tag);
      if (!guess) continue;
      const auto match = match_tag(reference, deformed.elements(), tag, *guess);
      if (!match) continue;
      TagPoint& placed = exact.tags.emplace_back(tag);
      placed.x_mm = array_of(vector_of(tag.x_mm) - match->error_mm * vector_of(tag.normal));
    }
    for (const ObservedPoint& point : design.points) {
      if (point.frame != frame) continue;
      const auto found = reference.find(vector_of(point.X_mm));
      if (!found) continue;
      exact.points.emplace_back(point).x_mm = array_of(mesh.value(position_mm[number], found->point));
    }
  }
  return exact;
}

Measurement with_noise(const Measurement& exact, std::span<const int> frames, const NoiseOptions& options,
                       std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  Measurement noisy;
  noisy.frames = exact.frames;
  for (Frame& frame : noisy.frames) {
    const double error_kPa = options.share * frame.sigma_kPa * normal(generator);
    if (options.exact_pressures) {
      frame.sigma_kPa = 0;
    } else {
      frame.pressure_kPa += error_kPa;
    }
  }
  const auto wanted = [&](int frame) {
    return std::find(frames.begin(), frames.end(), frame) != frames.end();
  };
  for (TagPoint tag : exact.tags) {
    if (!wanted(tag.frame)) continue;
    if (options.noise_mm > 0) tag.sigma_mm = options.noise_mm;
    const double error_mm = options.share * tag.sigma_mm * normal(generator);
    for (size_t k = 0; k < 3; ++k)
      tag.x_mm[k] += error_mm * tag.normal[k];
    noisy.tags.push_back(tag);
  }
  for (ObservedPoint point : exact.points) {
    if (!wanted(point.frame)) continue;
    if (options.noise_mm > 0) point.sigma_mm = options.noise_mm;
    for (double& x_mm : point.x_mm)
      x_mm += options.share * point.sigma_mm * normal(generator);
    noisy.points.push_back(point);
  }
  return noisy;
}

std::vector<int> spread_frames(const Measurement& measurement, int count) {
  std::vector<int> frames = loaded_frames(measurement);
  const int available = static_cast<int>(frames.size());
  if (count < 1 || count > available) {
    throw InputError({"", fmt::format("--frames {}", count),
                      fmt::format("the measurement has points in {} loaded frames", available),
                      fmt::format("Give counts from 1 to {}.", available)});
  }
  const auto pressure = [&](int frame) {
    return measurement.frames[static_cast<size_t>(frame)].pressure_kPa;
  };
  std::stable_sort(frames.begin(), frames.end(), [&](int a, int b) { return pressure(a) < pressure(b); });
  std::vector<int> chosen;
  for (int i = 1; i <= count; ++i)
    chosen.push_back(frames[static_cast<size_t>((i * available + count - 1) / count - 1)]);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

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
