// Faults planted one by one in data that are otherwise sound: each must be told, by its own name and with its number,
// and sound data must be met with silence.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/reconstruction/measurement_findings.hpp"
#include "estimator/reconstruction/slice_offsets.hpp"
#include "estimator/reconstruction/study_reconstruction.hpp"
#include "tests/estimator/reconstruction/tagged_motion.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

Study small_study() {
  Study study{};
  study.file = "gel.study.toml";
  study.specimen = AnnulusSpecimen{22.5, 50.0, 85.0, {4, 2, 1}, "fixed"};
  study.law = {"neo-hookean", {{"C1_kPa", 6.0, 1.0, 15.0, Variation::whole}}};
  return study;
}

std::string words(const std::vector<Finding>& findings) {
  std::string all;
  for (const Finding& finding : findings)
    all += finding.id + ": " + finding.what + " " + finding.remedy + "\n";
  return all;
}

/// The finding of that name; its absence fails the test.
Finding named(const std::vector<Finding>& findings, const std::string& id) {
  for (const Finding& finding : findings) {
    if (finding.id == id) return finding;
  }
  ADD_FAILURE() << "no finding " << id << " among\n" << words(findings);
  return {};
}

class Findings : public testing::Test {
 protected:
  static Measurement sound(const test::TaggedOptions& options = {.tags_a_frame = 400}) {
    return test::tagged_inflation(test::small_gel(), inner_mm, options);
  }
  static std::vector<Finding> at_sight(const Measurement& measurement) {
    return measurement_findings(measurement, test::small_gel());
  }
  static std::vector<Finding> in_motion(const Measurement& measurement, bool check_stiffness = false,
                                        std::optional<double> lambda = 1e4) {
    ReconstructionOptions options;
    options.check_stiffness = check_stiffness;
    options.lambda = lambda;
    return reconstruct_study(small_study(), measurement, options).findings;
  }

  static constexpr double inner_mm = 4.0;
};

TEST_F(Findings, SoundDataAreMetWithSilence) {
  for (const double sigma_mm : {0.13, 0.8}) {
    const auto found = in_motion(sound({.tags_a_frame = 400, .sigma_mm = sigma_mm}), true, {});
    EXPECT_THAT(found, IsEmpty()) << words(found);
  }
  for (const unsigned seed : {2U, 3U, 4U}) {
    const auto found = in_motion(sound({.tags_a_frame = 400, .seed = seed}));
    EXPECT_THAT(found, IsEmpty()) << words(found);
  }
}

/// Whatever the noise and the number of points, an incompressible motion's volume is constant within its errors, smoothing's own among them.
TEST_F(Findings, TheVolumesErrorCoversItWhateverTheNoise) {
  int frames = 0, beyond_two = 0;
  for (const double sigma_mm : {0.2, 0.5, 1.0})
    for (const size_t tags : {size_t{300}, size_t{900}})
      for (const unsigned seed : {1U, 2U}) {
        const StudyReconstruction found = reconstruct_study(
            small_study(), sound({.tags_a_frame = tags, .sigma_mm = sigma_mm, .seed = seed}), {});
        for (const VolumeCheck& volume : found.volumes) {
          const double sigmas = (volume.mean_ratio - 1.0) / volume.se;
          EXPECT_LT(std::abs(sigmas), 3.5) << sigma_mm << " mm, " << tags << " points, seed " << seed;
          beyond_two += std::abs(sigmas) > 2.0 ? 1 : 0;
          ++frames;
        }
      }
  EXPECT_EQ(frames, 48);
  EXPECT_LE(beyond_two, 9);  // one in twenty would be two; frames of one seed are not independent
}

TEST_F(Findings, ABodyThatSwells) {
  Measurement swollen = sound();
  swollen.tags.clear();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::normal_distribution<double> noise(0.0, 0.3);
  for (int i = 0; i < 1600; ++i) {
    const int frame = 1 + i % 4;
    const double r = 23 + 26 * unit(random), angle = 6.2 * unit(random), z = 82 * (unit(random) - 0.5);
    const std::array<double, 3> X{r * std::cos(angle), r * std::sin(angle), z};
    const double by = 1.0 + 0.03 * frame / 4.0;  // in each direction
    swollen.points.push_back(
        {frame, X, {by * X[0] + noise(random), by * X[1] + noise(random), by * X[2] + noise(random)}, 0.3});
  }
  const std::vector<Finding> reported = in_motion(swollen);
  const auto grown = std::ranges::find_if(reported, [](const Finding& finding) {
    return finding.id == "volume" && finding.where.find("frame 4") != std::string::npos;
  });
  ASSERT_NE(grown, reported.end()) << words(reported);
  EXPECT_NEAR(grown->number, 9.3, 1.0);
}

TEST_F(Findings, CoordinatesInAnotherUnit) {
  for (const auto& [in_mm, unit] :
       {std::pair{10.0, "centimetres"}, {25.4, "inches"}, {0.001, "micrometres"}}) {
    Measurement spoilt = sound();
    for (TagPoint& tag : spoilt.tags) {
      for (double& x : tag.x_mm)
        x /= in_mm;
    }
    const Finding finding = named(at_sight(spoilt), "length-unit");
    EXPECT_EQ(finding.severity, Severity::error);
    EXPECT_THAT(finding.what, HasSubstr(unit));
    EXPECT_THAT(finding.remedy, HasSubstr("Multiply"));
  }
}

TEST_F(Findings, TagPlanesThatAreNotTheTags) {
  Measurement spoilt = sound();
  for (TagPoint& tag : spoilt.tags)
    tag.plane_mm /= 10.0;
  EXPECT_EQ(named(at_sight(spoilt), "tag-planes").severity, Severity::error);
}

TEST_F(Findings, ASigmaThatIsNotTheScatter) {
  for (const double factor : {0.1, 5.0}) {
    Measurement spoilt = sound();
    for (TagPoint& tag : spoilt.tags)
      tag.sigma_mm *= factor;
    const Finding at_rest = named(at_sight(spoilt), "sigma");
    EXPECT_NEAR(at_rest.number, 1.0 / factor, 0.15 / factor);
    // Without the undeformed frame the motion tells it.
    std::erase_if(spoilt.tags, [](const TagPoint& tag) { return tag.frame == 0; });
    const Finding moving = named(in_motion(spoilt, false, {}), "sigma");
    EXPECT_NEAR(moving.number, 1.0 / factor, 0.25 / factor);
  }
}

TEST_F(Findings, ASigmaOfAHairInOneRow) {
  Measurement spoilt = sound();
  spoilt.tags[700].sigma_mm = 1e-5;
  EXPECT_GT(named(at_sight(spoilt), "sigma-range").number, 0.0);
}

TEST_F(Findings, RowsThatAreThereTwice) {
  Measurement spoilt = sound();
  spoilt.tags.insert(spoilt.tags.end(), spoilt.tags.begin() + 500, spoilt.tags.begin() + 507);
  EXPECT_EQ(named(at_sight(spoilt), "duplicate-rows").number, 7.0);
}

TEST_F(Findings, AFrameThatRepeatsAnother) {
  Measurement spoilt = sound();
  for (size_t i = 0; i < 400; ++i) {
    spoilt.tags[800 + i] = spoilt.tags[400 + i];
    spoilt.tags[800 + i].frame = 2;
  }
  const Finding finding = named(at_sight(spoilt), "repeated-frame");
  EXPECT_EQ(finding.number, 400.0);
  EXPECT_EQ(finding.where, "frame 2");
}

TEST_F(Findings, FramesWithoutPoints) {
  const Finding finding =
      named(at_sight(sound({.tags_a_frame = 200, .frames = {0, 1, 4}})), "missing-frames");
  EXPECT_EQ(finding.number, 2.0);
  EXPECT_THAT(finding.what, HasSubstr("2 and 3"));
}

TEST_F(Findings, AFrameOfWhichLittleWasTracked) {
  Measurement spoilt = sound();
  size_t kept = 0;
  std::erase_if(spoilt.tags, [&](const TagPoint& tag) { return tag.frame == 3 && ++kept > 60; });
  EXPECT_THAT(named(at_sight(spoilt), "sparse-frames").what, HasSubstr("Frame 3"));
}

TEST_F(Findings, FramesWithoutLoad) {
  Measurement spoilt = sound();
  spoilt.frames[1].pressure_kPa = 0.01;
  EXPECT_THAT(named(at_sight(spoilt), "unloaded-frames").what, HasSubstr("Frame 1 carries"));
  EXPECT_THAT(named(in_motion(spoilt), "motion-without-load").where, HasSubstr("frame 1"));
  for (Frame& frame : spoilt.frames)
    frame.pressure_kPa = 0.0;
  EXPECT_EQ(named(at_sight(spoilt), "unloaded-frames").severity, Severity::error);
}

TEST_F(Findings, APressureOffset) {
  Measurement spoilt = sound({.tags_a_frame = 400, .sigma_mm = 0.13});
  for (Frame& frame : spoilt.frames)
    frame.pressure_kPa += 0.6;
  EXPECT_NEAR(named(at_sight(spoilt), "pressure-at-rest").number, 0.6, 1e-9);
  spoilt.frames[0].pressure_kPa = 0.0;
  EXPECT_NEAR(named(in_motion(spoilt), "pressure-offset").number, 0.6, 0.3);
}

TEST_F(Findings, PlanesThatWereSeenUnderLoadAreNoPressureOffset) {
  // As the first image of a body that is already moved leaves them: too far apart, alike in all frames.
  Measurement seen = sound({.tags_a_frame = 400, .sigma_mm = 0.13});
  for (TagPoint& tag : seen.tags)
    tag.plane_mm *= 1.012;
  EXPECT_GT(named(in_motion(seen), "pressure-offset").number, 0.0);
  seen.planes_as_seen = true;
  for (const Finding& finding : in_motion(seen))
    EXPECT_NE(finding.id, "pressure-offset") << finding.what;
}

TEST_F(Findings, PointsOutsideTheWall) {
  Measurement spoilt = sound();
  for (size_t i = 0; i < 40; ++i) {
    TagPoint& tag = spoilt.tags[i];
    tag.x_mm = {0.2 * tag.x_mm[0], 0.2 * tag.x_mm[1], tag.x_mm[2]};
    tag.plane_mm = tag.normal[0] * tag.x_mm[0] + tag.normal[1] * tag.x_mm[1] + tag.normal[2] * tag.x_mm[2];
  }
  EXPECT_NEAR(named(at_sight(spoilt), "outside-wall").number, 40.0, 2.0);
  Measurement moving = sound();
  for (size_t i = 800; i < 830; ++i) {
    for (double& x : moving.tags[i].x_mm)
      x *= 3.0;
  }
  EXPECT_NEAR(named(in_motion(moving), "not-found").number, 100.0 * 30.0 / 1600.0, 0.5);
}

TEST_F(Findings, WildPoints) {
  const Finding finding = named(in_motion(sound({.tags_a_frame = 600, .wild_share = 0.05})), "wild-points");
  EXPECT_NEAR(finding.number, 4.5, 1.5);  // per cent; the least of the wild ones hide in the noise
  EXPECT_EQ(finding.severity, Severity::warning);
}

TEST_F(Findings, AMisplacedSlice) {
  constexpr double moved_mm = 0.6;
  Measurement spoilt = sound({.tags_a_frame = 600});
  // The short-axis image at z = 6 mm, its tags along (1, 1, 0)/√2, in all loaded frames.
  for (TagPoint& tag : spoilt.tags) {
    if (tag.frame == 0 || tag.normal[2] != 0 || tag.normal[1] < 0 || std::abs(tag.x_mm[2] - 6.0) > 1.0)
      continue;
    for (size_t k = 0; k < 3; ++k)
      tag.x_mm[k] += moved_mm * tag.normal[k];
  }
  const std::vector<Finding> found = in_motion(spoilt);
  const Finding finding = named(found, "slice-offset");
  EXPECT_NEAR(finding.number, moved_mm, 0.2);
  EXPECT_THAT(finding.what, HasSubstr("6.0 mm along (0, 0, 1)"));
  EXPECT_THAT(finding.what, HasSubstr("(0.71, 0.71, 0)"));
  EXPECT_EQ(
      std::count_if(found.begin(), found.end(), [](const Finding& f) { return f.id == "slice-offset"; }), 1);
}

/// The only image's offset is a shift of the body, which the field makes as well. What else its residuals have in common is no displacement.
TEST_F(Findings, TheOnlyImageHasNoneToBeMisplacedAgainst) {
  Measurement lone = sound({.tags_a_frame = 4000});
  std::erase_if(lone.tags,
                [](const TagPoint& tag) { return tag.normal[2] != 0 || std::abs(tag.x_mm[2] - 6.0) > 1.0; });
  const TagGroups groups = group_tags(lone.tags);
  ASSERT_EQ(groups.slices.size(), 2U);
  const HermiteMesh mesh = test::small_gel();
  const FieldForms forms(mesh, {});
  std::vector<FrameField> fields;
  fields.push_back(reconstruct_frame(forms, lone, 4, {.lambda = 1e4}));
  for (FieldRow& row : fields[0].rows)
    row.residual += 0.08 / row.sigma_mm;
  for (const SliceOffset& slice : slice_offsets(fields, groups, lone.tags)) {
    EXPECT_FALSE(slice.displaced) << slice.offset_mm << " +- " << slice.se_mm;
    EXPECT_GT(std::abs(slice.offset_mm), 5 * slice.se_mm) << "it is not for lack of significance";
  }
}

TEST_F(Findings, OneDirectionTrackedWorse) {
  Measurement spoilt = sound({.tags_a_frame = 600});
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0.0, 0.5);
  for (TagPoint& tag : spoilt.tags) {
    if (tag.normal[2] != 0 || tag.normal[1] < 0) continue;
    const double error_mm = noise(random);
    for (size_t k = 0; k < 3; ++k)
      tag.x_mm[k] += error_mm * tag.normal[k];
  }
  EXPECT_THAT(named(in_motion(spoilt), "tag-family").where, HasSubstr("(0.71, 0.71, 0)"));
}

TEST_F(Findings, FramesOfTheTwoFilesThatDisagree) {
  Measurement swapped = sound();
  std::swap(swapped.frames[1].pressure_kPa, swapped.frames[3].pressure_kPa);
  EXPECT_EQ(named(in_motion(swapped), "frames-disagree").severity, Severity::error);

  std::mt19937 random(7);
  std::normal_distribution<double> noise_mm(0.0, 0.3);
  Measurement still = sound();
  for (TagPoint& tag : still.tags) {
    const double along =
        tag.normal[0] * tag.x_mm[0] + tag.normal[1] * tag.x_mm[1] + tag.normal[2] * tag.x_mm[2];
    const double back_mm = tag.plane_mm - along + noise_mm(random);
    for (size_t k = 0; tag.frame == 3 && k < 3; ++k)
      tag.x_mm[k] += back_mm * tag.normal[k];
  }
  EXPECT_THAT(named(in_motion(still), "no-motion").where, HasSubstr("frame 3"));
}

TEST_F(Findings, AFrameInOtherAxes) {
  Measurement spoilt = sound();
  for (TagPoint& tag : spoilt.tags) {
    if (tag.frame == 2) tag.x_mm[0] += 45.0;
  }
  EXPECT_THAT(named(in_motion(spoilt), "far-motion").where, HasSubstr("frame 2"));
}

TEST_F(Findings, OneSliceOfOneDirectionIsNoReasonToRefuse) {
  // All that a turn out of the slice does to such tags is what a stretch does.
  Measurement sparse = sound({.tags_a_frame = 6000, .sigma_mm = 0.05});
  std::erase_if(sparse.tags, [](const TagPoint& tag) {
    return tag.normal[2] != 0 || tag.normal[1] < 0 || std::abs(tag.x_mm[2] - 6.0) > 1.0;
  });
  ASSERT_GT(sparse.tags.size(), 5U * 100U);
  const std::vector<Finding> found = examine_measurement(small_study(), sparse);
  EXPECT_FALSE(has_error(found)) << words(found);
}

TEST_F(Findings, PressuresInAnotherUnit) {
  Measurement spoilt = sound();
  for (Frame& frame : spoilt.frames) {
    frame.pressure_kPa *= 7.50062;
    frame.sigma_kPa *= 7.50062;
  }
  const Finding finding = named(in_motion(spoilt, true), "pressure-unit");
  EXPECT_EQ(finding.severity, Severity::error);
  EXPECT_THAT(finding.remedy, HasSubstr("mmHg"));
}

TEST_F(Findings, AMotionThatNoTagSees) {
  const Finding finding =
      named(in_motion(sound({.tags_a_frame = 400, .along_axis = false})), "unseen-motion");
  EXPECT_EQ(finding.number, 4.0);
  EXPECT_THAT(finding.what, HasSubstr("missed is motion along z"));
}

TEST(TagGroups, ImagesAreFoundFromWhereTheTagsAreSeen) {
  const HermiteMesh mesh = test::small_gel();
  const Measurement measurement = test::tagged_inflation(mesh, 4.0, {.tags_a_frame = 600});
  const TagGroups groups = group_tags(measurement.tags);
  EXPECT_EQ(groups.families.size(), 2U + 12U);
  EXPECT_EQ(groups.slices.size(), 2U * 6U + 12U);
  size_t tags = 0;
  for (const TagSlice& slice : groups.slices) {
    tags += slice.tags.size();
    for (const size_t i : slice.tags)
      ASSERT_NEAR(slice.image_normal.dot(Eigen::Vector3d(measurement.tags[i].x_mm.data())), slice.position_mm,
                  1e-6);
  }
  EXPECT_EQ(tags, measurement.tags.size());
}

}  // namespace
}  // namespace diastole
