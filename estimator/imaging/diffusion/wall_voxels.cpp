#include "estimator/imaging/diffusion/wall_voxels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "estimator/mesh/fibre_field.hpp"
#include "estimator/mesh/nodal_lines.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "estimator/mesh/refinement.hpp"
#include "estimator/parallel/parallel_for.hpp"

namespace diastole::imaging {
namespace {

constexpr std::array<size_t, 3> wanted_elements{16, 8, 4};
constexpr int most_halvings = 3;
/// Of a sinc: 1.207 pixels.
constexpr double width_px = 1.2;
/// The wall is cut into parts of at most so many pixels.
constexpr double part_px = 0.75;

/// Of the longest line along this xi, closed or open.
size_t elements_along(const HermiteMesh& mesh, size_t direction) {
  const NodalLines lines(mesh);
  size_t longest = 0;
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    size_t count = 0;
    for (auto next = lines.after(node, direction); next && count < mesh.node_count();
         next = lines.after(*next, direction)) {
      ++count;
      if (*next == node) break;
    }
    longest = std::max(longest, count);
  }
  return longest;
}

/// A part of the wall.
struct Part {
  WallSample sample;
  Eigen::Vector3d place_mm;
  double volume_mm3;
};

std::vector<Part> parts_of(const HermiteMesh& mesh, size_t element, double longest_mm) {
  const Eigen::Matrix3d sides = mesh.xi_gradient(mesh.reference(), {element, {0.5, 0.5, 0.5}});
  std::array<int, 3> count{};
  for (size_t k = 0; k < 3; ++k)
    count[k] = std::clamp(
        static_cast<int>(std::ceil(sides.col(static_cast<Eigen::Index>(k)).norm() / longest_mm)), 1, 64);
  std::vector<Part> parts;
  const auto place = [&](int i, size_t k) { return (i + 0.5) / count[k]; };
  for (int i3 = 0; i3 < count[2]; ++i3) {
    for (int i2 = 0; i2 < count[1]; ++i2) {
      for (int i1 = 0; i1 < count[0]; ++i1) {
        const MaterialPoint point{element, {place(i1, 0), place(i2, 1), place(i3, 2)}};
        Part part{{0, element, trilinear_basis(point.xi), wall_axes(mesh, point)},
                  mesh.value(mesh.reference(), point),
                  mesh.xi_gradient(mesh.reference(), point).determinant() / (count[0] * count[1] * count[2])};
        if (part.sample.axes.allFinite()) parts.push_back(part);
      }
    }
  }
  return parts;
}

/// The tensors' voxels by slice, row and column.
class VoxelGrid {
 public:
  VoxelGrid(const DiffusionSeries& series, const TensorImage& tensors) : series_(series) {
    const SlicePlane& plane = series.slices[0];
    index_.assign(series.slices.size(), Eigen::ArrayXXi::Constant(plane.rows, plane.columns, -1));
    for (size_t i = 0; i < tensors.voxels.size(); ++i) {
      const VoxelTensor& voxel = tensors.voxels[i];
      index_[static_cast<size_t>(voxel.slice)](voxel.row, voxel.column) = static_cast<int>(i);
    }
  }

  /// Calls found(i) for each voxel that averages over this place.
  template <class Found>
  void around(const Eigen::Vector3d& place_mm, const Found& found) const {
    for (size_t s = 0; s < series_.slices.size(); ++s) {
      const SlicePlane& plane = series_.slices[s];
      if (std::abs(plane.across_mm(place_mm)) > 0.5 * series_.thickness_mm) continue;
      const Eigen::Vector2d pixel = plane.pixel(place_mm);
      const double column = pixel.x(), row = pixel.y();
      constexpr double half = 0.5 * width_px;
      for (int r = static_cast<int>(std::ceil(row - half)); r <= row + half; ++r) {
        for (int c = static_cast<int>(std::ceil(column - half)); c <= column + half; ++c) {
          if (r < 0 || c < 0 || r >= plane.rows || c >= plane.columns) continue;
          if (const int i = index_[s](r, c); i >= 0) found(static_cast<size_t>(i));
        }
      }
    }
  }

 private:
  const DiffusionSeries& series_;
  std::vector<Eigen::ArrayXXi> index_;
};

}  // namespace

FibreLattice fibre_lattice(const HermiteMesh& mesh) {
  HermiteMesh finer = mesh;
  for (size_t direction = 0; direction < 3; ++direction) {
    size_t count = std::max<size_t>(elements_along(mesh, direction), 1);
    for (int i = 0; i < most_halvings && count < wanted_elements[direction]; ++i, count *= 2) {
      try {
        finer = Refinement(finer, direction).mesh();
      } catch (const std::invalid_argument&) {  // edges that are not smooth: as it is
        break;
      }
    }
  }
  std::vector<double> depth = NodalLines(finer).depths();
  return {std::move(finer), std::move(depth)};
}

std::vector<WallVoxel> centre_voxels(const FibreLattice& lattice, const TensorImage& tensors) {
  const HermiteMesh& mesh = lattice.mesh;
  const PointLocator locator(mesh, mesh.reference(), {.outside_xi = 0});
  std::vector<WallVoxel> all(tensors.voxels.size());
  parallel_for(all.size(), machine_threads(), [&](size_t i) {
    const auto located = locator.find(tensors.voxels[i].place_mm);
    if (!located) return;
    const MaterialPoint& point = located->point;
    const WallSample sample{1, point.element, trilinear_basis(point.xi), wall_axes(mesh, point)};
    if (!sample.axes.allFinite()) return;
    double depth = 0;
    for (size_t c = 0; c < corners; ++c)
      depth += sample.basis[c] * lattice.depth[mesh.element(point.element)[c]];
    all[i] = {&tensors.voxels[i], {sample}, 1.0, depth};
  });
  std::erase_if(all, [](const WallVoxel& voxel) { return voxel.samples.empty(); });
  return all;
}

std::vector<WallVoxel> wall_voxels(const FibreLattice& lattice, const DiffusionSeries& series,
                                   const TensorImage& tensors, double least_fraction) {
  const HermiteMesh& mesh = lattice.mesh;
  const SlicePlane& plane = series.slices[0];
  std::vector<std::vector<Part>> parts(mesh.element_count());
  parallel_for(parts.size(), machine_threads(),
               [&](size_t e) { parts[e] = parts_of(mesh, e, part_px * plane.finer_spacing_mm()); });
  const double extent_mm3 =
      width_px * plane.column_spacing_mm * width_px * plane.row_spacing_mm * series.thickness_mm;
  const VoxelGrid grid(series, tensors);
  std::vector<WallVoxel> all(tensors.voxels.size());
  for (const std::vector<Part>& of_element : parts) {
    for (const Part& part : of_element) {
      grid.around(part.place_mm, [&](size_t i) {
        all[i].samples.push_back(part.sample);
        all[i].samples.back().share = part.volume_mm3;
      });
    }
  }
  for (size_t i = 0; i < all.size(); ++i) {
    WallVoxel& voxel = all[i];
    voxel.voxel = &tensors.voxels[i];
    double inside_mm3 = 0;
    for (const WallSample& sample : voxel.samples)
      inside_mm3 += sample.share;
    for (WallSample& sample : voxel.samples) {
      sample.share /= inside_mm3;
      for (size_t c = 0; c < corners; ++c)
        voxel.depth += sample.share * sample.basis[c] * lattice.depth[mesh.element(sample.element)[c]];
    }
    voxel.fraction = std::min(1.0, inside_mm3 / extent_mm3);
  }
  std::erase_if(
      all, [&](const WallVoxel& voxel) { return voxel.samples.empty() || voxel.fraction < least_fraction; });
  return all;
}

}  // namespace diastole::imaging
