#include "tools/sim_scanner/diffusion_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "estimator/mesh/point_locator.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::scanner {
namespace {

constexpr int samples = 3;  // of a voxel, each way

/// Voxels that hold the body, in its axes.
struct Stack {
  Eigen::Vector3d first_mm;
  int pixels, slices;

  Stack(const HermiteMesh& mesh, const DiffusionProtocol& protocol) {
    double radius_mm = 0, low_mm = 1e300, high_mm = -1e300;
    for (size_t node = 0; node < mesh.node_count(); ++node) {
      const double* place = &mesh.reference()[dof_of(node, 0, 0)];
      radius_mm = std::max(radius_mm, std::hypot(place[0], place[1]));
      low_mm = std::min(low_mm, place[2]);
      high_mm = std::max(high_mm, place[2]);
    }
    pixels = 2 * static_cast<int>(std::ceil(radius_mm / protocol.pixel_mm)) + 4;
    slices = static_cast<int>(std::ceil((high_mm - low_mm) / protocol.thickness_mm));
    const double half_mm = 0.5 * protocol.pixel_mm * (pixels - 1);
    first_mm = {-half_mm, -half_mm, high_mm - protocol.thickness_mm * (slices - 0.5)};
  }
};

/// The fibres in a voxel's samples; fewer than all of them at the wall's edge.
std::vector<Eigen::Vector3d> fibres_in(const PointLocator& locator, const FibreAt& fibre,
                                       const Eigen::Vector3d& middle_mm, const Eigen::Vector3d& size_mm) {
  std::vector<Eigen::Vector3d> fibres;
  std::optional<MaterialPoint> beside;
  for (int i = 0; i < samples * samples * samples; ++i) {
    const Eigen::Vector3d within((i % samples + 0.5) / samples - 0.5,
                                 (i / samples % samples + 0.5) / samples - 0.5,
                                 (i / samples / samples + 0.5) / samples - 0.5);
    const auto found = locator.find(middle_mm + within.cwiseProduct(size_mm), beside);
    if (!found) continue;
    beside = found->point;
    fibres.push_back(fibre(found->point));
  }
  return fibres;
}

}  // namespace

std::vector<DiffusionLabel> DiffusionProtocol::weightings() const {
  std::vector<DiffusionLabel> all(static_cast<size_t>(unweighted));
  // A spiral over half of the sphere.
  for (int i = 0; i < directions; ++i) {
    const double z = (i + 0.5) / directions, around = 2 * std::numbers::pi * i / 2.618034;
    const double radius = std::sqrt(1 - z * z);
    all.push_back({b_s_mm2, {radius * std::cos(around), radius * std::sin(around), z}});
  }
  return all;
}

ScannedSeries scan_diffusion(const HermiteMesh& mesh, const FibreAt& fibre, const DiffusionProtocol& protocol,
                             const ScanPose& pose, const std::filesystem::path& folder) {
  const Stack stack(mesh, protocol);
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = 0, .tolerance_mm = 1e-6});
  const std::vector<DiffusionLabel> weightings = protocol.weightings();
  const auto uid = [&](int image) {
    return fmt::format("2.25.{}", (protocol.seed + 13ULL) * 1000000000ULL +
                                      static_cast<unsigned>(protocol.series) * 1000000ULL +
                                      static_cast<unsigned>(image));
  };
  parallel_for(static_cast<size_t>(stack.slices), machine_threads(), [&](size_t s) {
    const Eigen::Vector3d first_mm =
        stack.first_mm + protocol.thickness_mm * static_cast<double>(s) * Eigen::Vector3d::UnitZ();
    std::vector<Picture> pictures(weightings.size(), Picture::Zero(stack.pixels, stack.pixels));
    const Eigen::Vector3d size_mm(protocol.pixel_mm, protocol.pixel_mm, protocol.thickness_mm);
    for (int row = 0; row < stack.pixels; ++row) {
      for (int column = 0; column < stack.pixels; ++column) {
        const Eigen::Vector3d middle_mm = first_mm + protocol.pixel_mm * Eigen::Vector3d(column, row, 0);
        for (const Eigen::Vector3d& f : fibres_in(locator, fibre, middle_mm, size_mm)) {
          for (size_t v = 0; v < weightings.size(); ++v) {
            const double along = weightings[v].direction.dot(pose.axes * f);
            const double diffusivity = protocol.across * weightings[v].direction.squaredNorm() +
                                       (protocol.along - protocol.across) * along * along;
            pictures[v](row, column) += static_cast<float>(std::exp(-weightings[v].b_s_mm2 * diffusivity) /
                                                           (samples * samples * samples));
          }
        }
      }
    }
    std::mt19937 engine(1000003U * protocol.seed + static_cast<unsigned>(s));
    std::normal_distribution<float> noise(0, static_cast<float>(1 / protocol.snr));
    for (size_t v = 0; v < weightings.size(); ++v) {
      for (float& value : pictures[v].reshaped()) {
        const float imaginary = noise(engine);
        value = std::hypot(value + noise(engine), imaginary);
      }
      const int instance = static_cast<int>(v) * stack.slices + static_cast<int>(s) + 1;
      write_dicom(folder / fmt::format("d{:04}.dcm", instance), pictures[v],
                  {.study_uid = uid(0),
                   .series_uid = uid(999999),
                   .image_uid = uid(instance),
                   .series_number = protocol.series,
                   .instance = instance,
                   .trigger_ms = 0,
                   .interval_ms = 0,
                   .first_mm = pose.origin_mm + pose.axes * first_mm,
                   .along_row = pose.axes.col(0),
                   .along_column = pose.axes.col(1),
                   .pixel_mm = protocol.pixel_mm,
                   .thickness_mm = protocol.thickness_mm,
                   .diffusion = weightings[v]});
    }
  });
  return {protocol.series, "diffusion", "SA", {}, weightings.size() * static_cast<size_t>(stack.slices)};
}

}  // namespace diastole::scanner
