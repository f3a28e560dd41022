// A ventricle in the simulated scanner: its walls are found in the cines, its fibres in the diffusion series.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "estimator/imaging/diffusion/tensor_fit.hpp"
#include "estimator/imaging/geometry/cine_points.hpp"
#include "estimator/mesh/ellipsoid.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/sim_scanner/diffusion_scan.hpp"
#include "tools/sim_scanner/scanner.hpp"

namespace diastole::scanner {
namespace {

class VentricleScan : public testing::Test {
 protected:
  VentricleScan() : mesh_(make_ellipsoid(shape_)) {
    protocol_.short_axis_mm = {-36, -24, -12, 0};
    protocol_.long_axis_deg = {0, 60, 120};
    protocol_.middle_mm = -22.5;
    protocol_.field_of_view_mm = 100;
    protocol_.matrix = 100;
    protocol_.tagged = false;
    protocol_.cine = protocol_.dark_bath = true;
  }
  void scan_phases(int phases) const {
    MovingBody body{&mesh_, {}, {}, 1.0};
    for (int k = 0; k < phases; ++k) {
      body.times_s.push_back(0.01 + 0.1 * k);
      // It widens by 3 % from phase to phase: without motion an export is none.
      NodeField position_mm = mesh_.reference();
      for (size_t node = 0; node < mesh_.node_count(); ++node)
        for (size_t derivative = 0; derivative < 8; ++derivative)
          for (size_t axis = 0; axis < 2; ++axis)
            position_mm[dof_of(node, derivative, axis)] *= 1 + 0.03 * k;
      body.position_mm.push_back(position_mm);
    }
    const std::filesystem::path folder = scratch_.path() / std::to_string(phases);
    std::filesystem::create_directory(folder);
    (void)scan(body, protocol_, {}, folder, {});
  }

  EllipsoidShape shape_;
  HermiteMesh mesh_;
  ScanProtocol protocol_;
  test::ScratchFolder scratch_;
};

TEST_F(VentricleScan, WallsAndBaseAreFoundInItsCines) {
  scan_phases(4);
  // Another slice with phases of its own, as the magnitudes of phase contrast are, comes first and is no wall's.
  protocol_.short_axis_mm = {30};
  protocol_.long_axis_deg = {};
  protocol_.seed = 0;
  scan_phases(3);
  const imaging::GuidePoints guide = imaging::cine_guide_points(scratch_.path());
  ASSERT_EQ(guide.phases.size(), 4U);
  int walls = 0, base = 0;
  for (const imaging::GuidePoint& point : guide.points) {
    const Eigen::Vector3d& x = point.place_mm;
    if (point.surface == imaging::GuideSurface::base) {
      EXPECT_NEAR(x.z(), shape_.base_z_mm, 0.5);
      ++base;
      continue;
    }
    if (point.phase > 0) continue;
    const bool is_inner = point.surface == imaging::GuideSurface::endo;
    const auto& axes_mm = is_inner ? shape_.inner_axes_mm : shape_.outer_axes_mm;
    const double size = std::hypot(std::hypot(x.x(), x.y()) / axes_mm[0], x.z() / axes_mm[1]);
    EXPECT_NEAR(size * axes_mm[0], axes_mm[0], 0.6);
    ++walls;
  }
  EXPECT_GT(base, 40);
  EXPECT_GT(walls, 300);
}

TEST_F(VentricleScan, TissueDiffusesAlongItsFibres) {
  DiffusionProtocol protocol{.directions = 6, .unweighted = 1, .snr = 1000};
  const Eigen::Vector3d fibre(1, 0, 0);
  ScanPose pose;
  pose.axes << 0, -1, 0, 1, 0, 0, 0, 0, 1;  // fibres lie along the patient's y
  const ScannedSeries series = scan_diffusion(
      mesh_, [&](const MaterialPoint&) { return fibre; }, protocol, pose, scratch_.path());
  EXPECT_EQ(series.files, 7U * 13U);
  const imaging::TensorImage tensors = imaging::fit_tensors(imaging::read_diffusion(scratch_.path()));
  Eigen::Matrix3d expected = 0.8 * Eigen::Matrix3d::Identity();
  expected(1, 1) = 1.3;
  int whole = 0;
  for (const imaging::VoxelTensor& voxel : tensors.voxels) {
    if (voxel.s0 < 980) continue;  // partly of what gives no signal
    EXPECT_LT((imaging::matrix_of(voxel.tensor) - expected).norm(), 0.05);
    ++whole;
  }
  EXPECT_GT(whole, 1500);
}

}  // namespace
}  // namespace diastole::scanner
