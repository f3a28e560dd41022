// The loop closed: the motion of a model becomes images, the images are read and tracked by what knows nothing of the scanner, and the tags
// must lie where the model has them.

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>

#include "estimator/fe/elastic_model.hpp"
#include "estimator/imaging/series/views.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/mesh/annulus.hpp"
#include "estimator/mesh/point_locator.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/sim_scanner/scanner.hpp"

namespace diastole::scanner {
namespace {

/// A gel phantom at eight pressures.
class ScanLoop : public testing::Test {
 protected:
  ScanLoop() {
    AnnulusShape shape;
    shape.elements = {4, 4, 1};
    ElasticOptions options;
    options.parameters = {8.71};
    model_.emplace(make_annulus(shape), *find_law("neo-hookean"), options);
    body_.mesh = &model_->mesh();
    body_.period_s = 1.2;
    ElasticState state = model_->rest_state();
    for (int phase = 0; phase < 8; ++phase) {
      body_.times_s.push_back(0.012 + 0.075 * phase);
      state =
          model_->solve(3.1 * std::pow(std::sin(0.5 * M_PI * body_.times_s.back() / 0.6), 2), state).state;
      body_.position_mm.push_back(state.position_mm);
    }
  }

  std::optional<ElasticModel> model_;
  MovingBody body_;
};

/// Root mean square over the points of a folder of how far, in pixels along its normal, each lies from where the model has its plane; and of that
/// over the points' own sigma.
struct LoopErrors {
  double rms_px = 0, own = 0, points = 0;
};

LoopErrors errors_of(const imaging::TrackedFolder& tracked, const MovingBody& body, const ScanPose& pose,
                     double pixel_mm, double spacing_mm) {
  LoopErrors errors;
  std::map<int, PointLocator> locators;
  // Where a slice's planes lie is the protocol's secret: the tracker's are right but for a hundredth of a millimetre or so, alike in
  // all phases, which is left out here by comparing with the planes as tracked.
  for (const imaging::TrackedPoint& point : tracked.points) {
    const auto phase = static_cast<size_t>(point.frame - 1);
    const auto locator =
        locators
            .try_emplace(point.frame, *body.mesh, body.position_mm[phase], LocatorOptions{.outside_xi = 0.1})
            .first;
    const Eigen::Vector3d x_mm = pose.axes.transpose() * (point.x_mm - pose.origin_mm);
    const Eigen::Vector3d normal = pose.axes.transpose() * point.normal;
    const double plane_mm = point.plane_mm - point.normal.dot(pose.origin_mm);
    const auto n_dot_X = [&](const Eigen::Vector3d& place_mm) -> std::optional<double> {
      const auto found = locator->second.find(place_mm);
      if (!found) return std::nullopt;
      return normal.dot(body.mesh->value(body.mesh->reference(), found->point));
    };
    const auto here = n_dot_X(x_mm), ahead = n_dot_X(x_mm + 0.1 * normal);
    if (!here || !ahead) continue;
    const double error_mm = (*here - plane_mm) / ((*ahead - *here) / 0.1);
    EXPECT_LT(std::abs(error_mm), 0.5 * spacing_mm);
    errors.rms_px += std::pow(error_mm / pixel_mm, 2);
    errors.own += std::pow((error_mm + point.own_mm) / point.own_sigma_mm, 2);
    errors.points += 1;
  }
  errors.rms_px = std::sqrt(errors.rms_px / errors.points);
  errors.own /= errors.points;
  return errors;
}

TEST_F(ScanLoop, TagsAreFoundWhereTheModelHasThem) {
  const test::ScratchFolder scratch;
  ScanProtocol protocol;
  protocol.short_axis_mm = {12.0};
  protocol.long_axis_deg = {35.0};
  ScanPose pose;
  pose.axes = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  pose.origin_mm = {10, -20, 5};
  size_t heard = 0;
  const std::vector<ScannedSeries> series = scan(body_, protocol, pose, scratch.path(),
                                                 [&](size_t done, size_t) { heard = std::max(heard, done); });
  ASSERT_EQ(series.size(), 4U);
  EXPECT_EQ(heard, 32U);
  const imaging::TrackedFolder tracked =
      imaging::track_folder({.folder = scratch.path(), .coordinates = "patient"});
  const double pixel_mm = protocol.field_of_view_mm / protocol.matrix;
  const LoopErrors errors = errors_of(tracked, body_, pose, pixel_mm, protocol.tags.spacing_mm);
  EXPECT_GT(errors.points, 8 * 4 * 200);
  EXPECT_LT(errors.rms_px, 0.06);
  EXPECT_GT(errors.own, 0.9);
  EXPECT_LT(errors.own, 1.1);
}

TEST_F(ScanLoop, AGridOfBinomialTagsAndACineAreToldForWhatTheyAre) {
  const test::ScratchFolder scratch;
  ScanProtocol protocol;
  protocol.tags.grid = true;
  protocol.tags.spacing_mm = 6;
  protocol.cine = true;
  (void)scan(body_, protocol, {}, scratch.path(), {});
  const imaging::ImageFolder folder = imaging::read_image_folder(scratch.path());
  ASSERT_EQ(folder.series.size(), 2U);
  EXPECT_EQ(folder.series[0].kind, imaging::SeriesKind::tagged_cine);
  ASSERT_EQ(folder.series[0].slices[0].tags.size(), 2U);
  EXPECT_NEAR(folder.series[0].slices[0].tags[0].spacing_mm(), 6, 0.05);
  EXPECT_EQ(folder.series[1].kind, imaging::SeriesKind::cine);
  EXPECT_EQ(folder.series[0].phases.times_ms.size(), 8U);
  EXPECT_NEAR(folder.series[0].phases.times_ms[1], 87, 1e-6);
}

TEST_F(ScanLoop, NoiseIsAsTheProtocolSays) {
  // A slice without tags of a body at rest: tissue of brightness 1 whose magnitude scatters by 1 / snr.
  const test::ScratchFolder scratch;
  ScanProtocol protocol;
  protocol.tagged = false;
  protocol.cine = true;
  protocol.shading = 0;
  protocol.snr = 25;
  MovingBody still = body_;
  still.times_s = {0.012, 0.1};
  still.position_mm = {model_->mesh().reference(), model_->mesh().reference()};
  (void)scan(still, protocol, {}, scratch.path(), {});
  const imaging::ImageFolder folder = imaging::read_image_folder(scratch.path());
  const auto images = folder.pixels(folder.series[0].slices[0].images);
  const imaging::SlicePlane& plane = folder.series[0].plane();
  double square = 0, mean = 0, count = 0;
  for (int row = 0; row < plane.rows; ++row) {
    for (int column = 0; column < plane.columns; ++column) {
      const double radius_mm =
          plane.at({column * plane.column_spacing_mm, row * plane.row_spacing_mm}).head<2>().norm();
      if (radius_mm < 28 || radius_mm > 44) continue;
      square += std::pow(static_cast<double>(images[1](row, column) - images[0](row, column)), 2);
      mean += static_cast<double>(images[0](row, column));
      count += 1;
    }
  }
  mean /= count;
  EXPECT_NEAR(mean, 1000, 5);
  // The taper takes a tenth of the noise's power.
  EXPECT_NEAR(std::sqrt(square / count / 2) / mean, 1.0 / 25, 0.1 / 25);
}

}  // namespace
}  // namespace diastole::scanner
