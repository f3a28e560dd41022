#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::imaging {
namespace {

using test::RingScan;
using test::ScratchFolder;
using testing::HasSubstr;

struct Errors {
  double rms_px = 0, normalised = 0, worst_px = 0;
  size_t points = 0;
};

Errors errors_of(const RingScan& scan, const TrackedFolder& tracked) {
  Errors errors;
  for (const TrackedPoint& point : tracked.points) {
    // A normal's sign is free.
    const double plane_mm = point.normal.dot(scan.normal()) < 0 ? -point.plane_mm : point.plane_mm;
    const double nearest = std::round(plane_mm / scan.tag_spacing_mm) * scan.tag_spacing_mm;
    const double off_px = (scan.material_mm(point.frame, point.x_mm) - nearest) / scan.pixel_mm;
    errors.rms_px += off_px * off_px;
    errors.normalised += std::pow(off_px * scan.pixel_mm / point.sigma_mm, 2);
    errors.worst_px = std::max(errors.worst_px, std::abs(off_px));
    ++errors.points;
  }
  errors.rms_px = std::sqrt(errors.rms_px / static_cast<double>(errors.points));
  errors.normalised /= static_cast<double>(errors.points);
  return errors;
}

TEST(Tracking, FollowsARingToAFewHundredthsOfAPixelAndKnowsItsErrors) {
  const ScratchFolder scratch;
  const RingScan scan;
  test::write_ring(scan, scratch.path());
  const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
  const Errors errors = errors_of(scan, tracked);
  EXPECT_LT(errors.rms_px, 0.06);
  EXPECT_LT(errors.worst_px, 0.5);
  // One slice has some hundred independent errors, and they are alike from phase to phase.
  EXPECT_GT(errors.normalised, 0.3);
  EXPECT_LT(errors.normalised, 2.5);
  // Lines of gel over their distance, a point about every 4 mm.
  EXPECT_GT(errors.points, 8U * 130U);
}

TEST(Tracking, AGhostIsFoundInTheAirAndTakenOffAsFarAsItsPhaseIsSeen) {
  for (const double turn_rad : {0.0, 2.0, 3.14159}) {
    const ScratchFolder scratch;
    const RingScan scan{.noise = 20, .ghost_rows = 21, .ghost_turn_rad = turn_rad};
    test::write_ring(scan, scratch.path());
    const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
    const std::vector<Ghost>& ghosts = tracked.slices.at(0).tracked.ghosts;
    ASSERT_FALSE(ghosts.empty()) << turn_rad;
    EXPECT_TRUE(ghosts[0].down);
    EXPECT_EQ(ghosts[0].shift, 21);
    EXPECT_NEAR(ghosts[0].share, scan.ghost_share, 0.02);
    EXPECT_NEAR(ghosts[0].in_phase, scan.ghost_share * std::cos(turn_rad),
                std::max(3 * ghosts[0].in_phase_sigma, 0.015))
        << turn_rad;
    EXPECT_LT(ghosts[0].in_phase_sigma, 0.4 * ghosts[0].share) << turn_rad;
    const Errors errors = errors_of(scan, tracked);
    EXPECT_LT(errors.rms_px, 0.035) << turn_rad;
    EXPECT_GT(errors.normalised, 0.3) << turn_rad;
    EXPECT_LT(errors.normalised, 2.5) << turn_rad;
  }
  const ScratchFolder clean;
  test::write_ring({.noise = 20}, clean.path());
  const TrackedFolder without = track_folder({.folder = clean.path(), .coordinates = "patient"});
  EXPECT_TRUE(without.slices.at(0).tracked.ghosts.empty());
}

TEST(Tracking, FollowsMirroredTurnedAndStretchedImagesAsWell) {
  const Eigen::Vector3d x(1, 0, 0), y(0, 1, 0);
  const std::vector<RingScan> scans = {
      {.origin_mm = {47.5, -47.5, 12}, .along_row = -x},                     // mirrored
      {.along_row = y, .along_column = x},                                   // rows and columns exchanged
      {.origin_mm = {47.5, 47.5, 12}, .along_row = -x, .along_column = -y},  // turned upside down
      {.stretch = 1.3},
      {.tag_angle_deg = 0, .origin_mm = {47.5, -47.5, 12}, .along_row = -x, .stretch = 1.3}};
  for (size_t i = 0; i < scans.size(); ++i) {
    const ScratchFolder scratch;
    test::write_ring(scans[i], scratch.path());
    const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
    const Errors errors = errors_of(scans[i], tracked);
    EXPECT_LT(errors.rms_px, 0.06) << i;
    EXPECT_LT(errors.worst_px, 0.5) << i;
    EXPECT_GT(errors.points, 8U * 130U) << i;
  }
}

TEST(Tracking, FollowsAWallOfAnyFadingInAirAsWellAsInWater) {
  struct Wall {
    double spacing_mm, inner_mm, T1_s;
  };
  for (const auto& [spacing_mm, inner_mm, T1_s] : {Wall{4, 28, 0.8}, Wall{6, 28, 0.8}, Wall{5, 24, 1.4}}) {
    size_t in_water = 0;
    for (const double water_mm : {46.0, 0.0}) {
      SCOPED_TRACE(testing::Message() << "tags every " << spacing_mm << " mm, T1 " << T1_s << " s, water to "
                                      << water_mm << " mm");
      const ScratchFolder scratch;
      const RingScan scan{
          .tag_spacing_mm = spacing_mm, .inner_mm = inner_mm, .gel_T1_s = T1_s, .water_mm = water_mm};
      test::write_ring(scan, scratch.path());
      const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
      const Errors errors = errors_of(scan, tracked);
      EXPECT_LT(errors.rms_px, 0.1);
      EXPECT_LT(errors.worst_px, 0.5);
      if (water_mm > 0) in_water = errors.points;
      EXPECT_GT(errors.points, in_water * 9 / 10);
    }
    EXPECT_GT(in_water, 400U);
  }
}

TEST(Tracking, FollowsAWallInAirThatEndsFarFromWhereItBegan) {
  const ScratchFolder scratch;
  // The inner edge moves by six of the wall's ten millimetres, and stays there.
  const RingScan scan{.phases = 16, .most_mm2 = 400, .step_ms = 36, .inner_mm = 28, .water_mm = 0};
  test::write_ring(scan, scratch.path());
  const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
  const Errors errors = errors_of(scan, tracked);
  EXPECT_LT(errors.rms_px, 0.06);
  EXPECT_LT(errors.worst_px, 0.5);
  EXPECT_GT(errors.points, 16U * 90U);
}

TEST(Tracking, ReportsASliceThatGivesNoPoint) {
  const ScratchFolder scratch;
  test::write_ring({}, scratch.path());
  // A wall of a third of a spacing.
  test::write_ring({.series = 3, .origin_mm = {-47.5, -47.5, 30.0}, .uid = "1.2.4", .inner_mm = 36.5},
                   scratch.path(), "thin");
  const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
  ASSERT_EQ(tracked.slices.size(), 2U);
  EXPECT_FALSE(tracked.slices[0].points.points.empty());
  EXPECT_TRUE(tracked.slices[1].points.points.empty());
  EXPECT_THAT(tracked.problems,
              testing::Contains(testing::AllOf(testing::Field(&Finding::id, "not-tracked"),
                                               testing::Field(&Finding::where, "series 3, slice 1"))));
}

TEST(Tracking, NumbersFramesByPhaseAcrossAGap) {
  const ScratchFolder scratch;
  const RingScan scan{.missing_phase = 5};
  test::write_ring(scan, scratch.path());
  const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
  EXPECT_LT(errors_of(scan, tracked).rms_px, 0.08);
  EXPECT_TRUE(std::none_of(tracked.points.begin(), tracked.points.end(),
                           [](const TrackedPoint& p) { return p.frame == 5; }));
  EXPECT_TRUE(std::any_of(tracked.points.begin(), tracked.points.end(),
                          [](const TrackedPoint& p) { return p.frame == 8; }));
}

TEST(Tracking, UsesAPoseAndSaysWhatIsMissingWithoutOne) {
  const ScratchFolder scratch;
  const RingScan scan;
  std::filesystem::create_directory(scratch.path() / "dicom");
  test::write_ring(scan, scratch.path() / "dicom");
  const TrackedFolder without = track_folder({.folder = scratch.path() / "dicom", .coordinates = "auto"});
  EXPECT_FALSE(without.pose);
  EXPECT_THAT(without.problems.back().what, HasSubstr("two ends"));
  EXPECT_THAT(test::message_of([&] {
                (void)track_folder({.folder = scratch.path() / "dicom", .coordinates = "specimen"});
              }),
              HasSubstr("--pose"));

  // The remedy is a line to be copied.
  const std::string line = R"({"slice": "series 2, slice 1", "action": "height", "height_mm": 0})";
  EXPECT_THAT(without.problems.back().remedy, HasSubstr(line));
  scratch.write("dicom.edits.jsonl",
                R"({"slice": "series 2, slice 1", "action": "height", "height_mm": -7.5})");
  const TrackedFolder given = track_folder({.folder = scratch.path() / "dicom", .coordinates = "specimen"});
  ASSERT_TRUE(given.pose);
  // The ring's middle is patient (0, 0), the slice lies in z = 12.
  EXPECT_NEAR((given.pose->origin_mm - Eigen::Vector3d(0, 0, 19.5)).norm(), 0, 0.2);
  EXPECT_NEAR(given.points.at(0).x_mm.z(), -7.5, 0.01);
  std::filesystem::remove(scratch.path() / "dicom.edits.jsonl");

  SpecimenPose pose;
  pose.origin_mm = {0.5, -0.25, 10};
  scratch.write("ring.pose.toml", pose_text(pose, "annulus"));
  const TrackedFolder with = track_folder({.folder = scratch.path() / "dicom", .coordinates = "auto"});
  ASSERT_TRUE(with.pose);
  ASSERT_EQ(with.points.size(), without.points.size());
  EXPECT_NEAR((with.points[0].x_mm + pose.origin_mm - without.points[0].x_mm).norm(), 0, 1e-9);
  EXPECT_NEAR(with.points[0].plane_mm + with.points[0].normal.dot(pose.origin_mm), without.points[0].plane_mm,
              1e-9);
}

TEST(Tracking, RefusesAFolderWithoutTags) {
  const ScratchFolder scratch;
  test::write_ring({.tagged = false}, scratch.path());
  EXPECT_THAT(
      test::message_of([&] { (void)track_folder({.folder = scratch.path(), .coordinates = "patient"}); }),
      HasSubstr("no tagged cine"));
}

TEST(Tracking, NoNameOfAPatientLeavesTheFiles) {
  const ScratchFolder scratch;
  test::write_ring({}, scratch.path());
  const TrackedFolder tracked = track_folder({.folder = scratch.path(), .coordinates = "patient"});
  std::string said = tags_file_text(tracked.points);
  for (const TrackedSlice& slice : tracked.slices)
    said += slice.view.name;
  for (const Finding& finding : tracked.problems)
    said += finding.what + finding.where + finding.remedy;
  for (const ImageSeries& series : read_image_folder(scratch.path()).series)
    said += series.reason + series.vendor;
  EXPECT_THAT(said, testing::Not(testing::AnyOf(HasSubstr("DOE"), HasSubstr("SECRET"), HasSubstr("1.2.3"))));
}

TEST(SpecimenPose, RefusesAxesThatAreNone) {
  const ScratchFolder scratch;
  const auto file =
      scratch.write("bad.pose.toml",
                    "origin_mm = [0.0, 0.0, 0.0]\nx_axis = [1.0, 0.0, 0.0]\ny_axis = [0.5, 1.0, 0.0]\n"
                    "z_axis = [0.0, 0.0, 1.0]\n");
  EXPECT_THAT(test::message_of([&] { (void)read_pose(file); }), HasSubstr("right angles"));
  const auto short_axis = scratch.write("short.pose.toml",
                                        "origin_mm = [0, 0, 0]\nx_axis = [1, 0, 0]\ny_axis = [0, 1]\n"
                                        "z_axis = [0, 0, 1]\n");
  EXPECT_THAT(test::message_of([&] { (void)read_pose(short_axis); }), HasSubstr("y_axis"));
  const auto endless =
      scratch.write("endless.pose.toml",
                    "origin_mm = [0, 0, 0]\nx_axis = [1e200, 1e200, 0]\ny_axis = [1e200, -1e200, 0]\n"
                    "z_axis = [0, 0, 1]\n");
  EXPECT_THAT(test::message_of([&] { (void)read_pose(endless); }), HasSubstr("right angles"));
}

TEST(SplinePlane, PriorHasUnitVarianceAndCarriesAPlane) {
  Eigen::Matrix2Xd samples(2, 400);
  for (Eigen::Index i = 0; i < 400; ++i)
    samples.col(i) = Eigen::Vector2d(static_cast<double>(i % 20), static_cast<double>(i / 20)) * 4.0;
  const SplinePlane splines(samples, 10.0);
  const Eigen::MatrixXd covariance = splines.precision(1.0 / 30).inverse();
  const SplineValues values = splines.at({40, 40});
  double variance = 0, sum = 0;
  for (size_t i = 0; i < 16; ++i) {
    sum += values.value(i);
    for (size_t j = 0; j < 16; ++j)
      variance += values.value(i) * values.value(j) * covariance(values.index[i], values.index[j]);
  }
  EXPECT_NEAR(sum, 1.0, 1e-12);
  EXPECT_NEAR(variance, 1.0, 0.4);
}

}  // namespace
}  // namespace diastole::imaging
