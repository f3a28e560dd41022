// A ventricle in the simulated scanner: its walls are found in the cines, its fibres in the diffusion series.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>

#include "estimator/imaging/diffusion/tensor_fit.hpp"
#include "estimator/imaging/geometry/cine_points.hpp"
#include "estimator/imaging/geometry/ventricle_fit.hpp"
#include "estimator/imaging/geometry/wall_map.hpp"
#include "estimator/imaging/series/image_folder.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/tools/sim_scanner/scanned_ventricle.hpp"
#include "tools/sim_scanner/diffusion_scan.hpp"

namespace diastole::scanner {
namespace {

class VentricleScan : public testing::Test {
 protected:
  void scan_phases(int phases, double step_s = 0.1) const {
    ventricle_.scan_phases(phases, scratch_.path() / std::to_string(phases), step_s);
  }

  ScannedVentricle ventricle_;
  const EllipsoidShape& shape_ = ventricle_.shape;
  HermiteMesh& mesh_ = ventricle_.mesh;
  ScanProtocol& protocol_ = ventricle_.protocol;
  test::ScratchFolder scratch_;
};

TEST_F(VentricleScan, WallsAndBaseAreFoundInItsCines) {
  scan_phases(4);
  // Another slice with phases of its own, as the magnitudes of phase contrast are, comes first and is no wall's.
  protocol_.short_axis_mm = {30};
  protocol_.long_axis_deg = {};
  protocol_.seed = 0;
  scan_phases(3, 0.13);
  const imaging::GuidePoints guide =
      imaging::cine_guide_points(imaging::read_cines(imaging::read_image_folder(scratch_.path())));
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

struct Contour {
  Eigen::Vector2d sum_mm = Eigen::Vector2d::Zero();
  int points = 0;
};
using Contours = std::map<std::pair<std::string, imaging::GuideSurface>, Contour>;

/// In the first phase's short-axis slices.
Contours contours_in(const std::filesystem::path& folder) {
  const imaging::GuidePoints guide =
      imaging::cine_guide_points(imaging::read_cines(imaging::read_image_folder(folder)));
  Contours contours;
  for (const imaging::GuidePoint& point : guide.points) {
    if (point.phase > 0 || !guide.slices[point.slice].starts_with("sa")) continue;
    Contour& contour = contours[{guide.slices[point.slice], point.surface}];
    contour.sum_mm += point.place_mm.head<2>();
    ++contour.points;
  }
  return contours;
}

TEST_F(VentricleScan, ImagesShowTheBodyWhereItIs) {
  protocol_.shading = 0;
  protocol_.snr = 1000;
  protocol_.acquired = 1;
  scan_phases(2);
  const Contours contours = contours_in(scratch_.path());
  ASSERT_GE(contours.size(), 6U);
  for (const auto& [place, contour] : contours)
    EXPECT_LT((contour.sum_mm / contour.points).norm(), 0.02) << place.first << ", pixels of 1 mm";
}

TEST_F(VentricleScan, CoilsThatShadeDisplaceNoContour) {
  protocol_.shading = 0.6;
  scan_phases(4);
  const Contours contours = contours_in(scratch_.path());
  ASSERT_GE(contours.size(), 6U);
  for (const auto& [place, contour] : contours) {
    EXPECT_EQ(contour.points, 24) << place.first;
    EXPECT_LT((contour.sum_mm / contour.points).norm(), 0.1)
        << place.first << " of the round ventricle's axis";
  }
}

TEST_F(VentricleScan, WallsFittedToItsCinesAreTrueFromApexToBase) {
  scan_phases(4);
  const imaging::VentricleFit fit = imaging::fit_ventricle(
      imaging::cine_guide_points(imaging::read_cines(imaging::read_image_folder(scratch_.path()))));
  const imaging::WallMap map(fit.frame, fit.phases[0]);
  for (const bool is_inner : {true, false}) {
    const auto& axes_mm = is_inner ? shape_.inner_axes_mm : shape_.outer_axes_mm;
    const auto error_mm = [&](double mu, double theta) {
      const double across_mm = axes_mm[0] * std::sin(mu);
      return map.distance_mm(is_inner ? -0.5 : 0.5,
                             fit.frame.inside({across_mm * std::cos(theta), across_mm * std::sin(theta),
                                               -axes_mm[1] * std::cos(mu)}));
    };
    double sum = 0, squares = 0, count = 0;
    for (double mu = 0.1; - axes_mm[1] * std::cos(mu) < shape_.base_z_mm; mu += 0.1)
      for (double theta = 0; theta < 6; theta += 0.5) {
        const double error = error_mm(mu, theta);
        sum += error;
        squares += error * error;
        count += 1;
      }
    // A tenth of a pixel on average.
    EXPECT_NEAR(sum / count, 0, 0.1) << is_inner;
    EXPECT_LT(std::sqrt(squares / count), 0.15) << is_inner;
  }
}

/// Mean distance of the inner wall's points from the axis, by phase.
std::vector<double> inner_radius_mm(const imaging::GuidePoints& guide) {
  std::vector<double> sum(guide.phases.size()), count(guide.phases.size());
  for (const imaging::GuidePoint& point : guide.points) {
    if (point.surface != imaging::GuideSurface::endo || guide.slices[point.slice] != "sa01") continue;
    sum[point.phase] += point.place_mm.head<2>().norm();
    count[point.phase] += 1;
  }
  for (size_t p = 0; p < sum.size(); ++p)
    sum[p] /= count[p];  // NaN where the slice has none
  return sum;
}

TEST_F(VentricleScan, AMissingImageMovesNoOtherToItsPhase) {
  scan_phases(6);
  const std::vector<double> whole = inner_radius_mm(
      imaging::cine_guide_points(imaging::read_cines(imaging::read_image_folder(scratch_.path()))));
  // Of one half of the slices the third image is lost, of the other the fifth: all have five.
  const imaging::ImageFolder folder = imaging::read_image_folder(scratch_.path());
  size_t count = 0;
  for (const imaging::ImageSeries& series : folder.series)
    for (const imaging::SliceImages& slice : series.slices)
      std::filesystem::remove(folder.files[folder.images[slice.images[count++ % 2 == 0 ? 2 : 4]].file]);
  ASSERT_EQ(count, 7U);
  const imaging::GuidePoints guide =
      imaging::cine_guide_points(imaging::read_cines(imaging::read_image_folder(scratch_.path())));
  ASSERT_EQ(guide.phases.size(), 6U);
  const std::vector<double> found = inner_radius_mm(guide);
  int compared = 0;
  for (size_t p = 0; p < found.size(); ++p) {
    if (std::isnan(found[p])) continue;
    EXPECT_NEAR(found[p], whole[p], 0.1) << p;  // the next phase's is half a millimetre larger
    ++compared;
  }
  EXPECT_EQ(compared,
            4);  // its own lost one, and its neighbour's, without which the wall's slope is not known
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
