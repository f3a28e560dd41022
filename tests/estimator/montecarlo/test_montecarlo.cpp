#include "estimator/montecarlo/montecarlo.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/mesh/annulus.hpp"
#include "estimator/montecarlo/synthetic_data.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::ElementsAre;

class CoarseGel : public testing::Test {
 protected:
  CoarseGel() {
    study_.file = "gel.study.toml";
    study_.specimen = AnnulusSpecimen{22.5, 50, 85, {4, 2, 1}, "fixed"};
    study_.law = {"neo-hookean", {{"C1_kPa", 8.71, 1.0, 15.0, Variation::whole}}};
    for (int frame = 0; frame <= 5; ++frame)
      design_.frames.push_back({0.1 * frame, 0.6 * frame, frame == 0 ? 0.0 : 0.02});
    for (int frame = 0; frame <= 5; ++frame) {
      for (int i = 0; i < 60; ++i) {
        const double angle = 0.7 * i, radius_mm = 25 + i % 20, z_mm = -35 + 1.2 * i;
        const std::array<double, 3> X{radius_mm * std::cos(angle), radius_mm * std::sin(angle), z_mm};
        const bool across = i % 2 == 0;
        const std::array<double, 3> n{across ? 1.0 : 0.0, across ? 0.0 : 1.0, 0.0};
        design_.tags.push_back({frame, n, across ? X[0] : X[1], X, 0.4});
        design_.points.push_back({frame, X, X, 0.5});
      }
    }
  }
  Study study_;
  Measurement design_;
};

TEST_F(CoarseGel, FramesAreSpreadUpToTheHighestPressure) {
  EXPECT_THAT(spread_frames(design_, 1), ElementsAre(5));
  EXPECT_THAT(spread_frames(design_, 3), ElementsAre(2, 4, 5));
  EXPECT_THAT(spread_frames(design_, 5), ElementsAre(1, 2, 3, 4, 5));
  design_.frames[2].pressure_kPa = 9;
  EXPECT_THAT(spread_frames(design_, 1), ElementsAre(2));
  EXPECT_THAT(test::message_of([&] { (void)spread_frames(design_, 6); }),
              testing::HasSubstr("5 loaded frames"));
}

TEST_F(CoarseGel, NoiseHasTheSizeAskedForAndIsStated) {
  std::mt19937_64 generator(1);
  const std::vector<int> frames{3, 5};
  const Measurement noisy = with_noise(design_, frames, {0.7, false}, generator);
  EXPECT_EQ(noisy.tags.size(), 120U);
  double tags = 0, points = 0;
  for (size_t i = 0; i < noisy.tags.size(); ++i) {
    const TagPoint& tag = noisy.tags[i];
    EXPECT_EQ(tag.sigma_mm, 0.7);
    const TagPoint& original = design_.tags[static_cast<size_t>(tag.frame) * 60 + i % 60];
    for (size_t k = 0; k < 3; ++k) {
      const double moved_mm = tag.x_mm[k] - original.x_mm[k];
      EXPECT_TRUE(tag.normal[k] != 0 || moved_mm == 0);  // only along the normal
      tags += moved_mm * moved_mm / 120;
      points += std::pow(noisy.points[i].x_mm[k] - original.x_mm[k], 2) / 360;
    }
  }
  EXPECT_NEAR(std::sqrt(tags), 0.7, 0.15);
  EXPECT_NEAR(std::sqrt(points), 0.7, 0.09);
  EXPECT_NE(noisy.frames[3].pressure_kPa, design_.frames[3].pressure_kPa);
  const Measurement stated = with_noise(design_, frames, {0, true}, generator);
  EXPECT_EQ(stated.tags[0].sigma_mm, 0.4);
  EXPECT_EQ(stated.frames[3].pressure_kPa, design_.frames[3].pressure_kPa);
  EXPECT_EQ(stated.frames[3].sigma_kPa, 0);
}

TEST_F(CoarseGel, CellsAreTheSameInWhateverPlanTheyStand) {
  MonteCarloPlan plan{.noise_mm = {0.4}, .frames = {2}, .repeats = 2};
  CellFitter one(study_, design_, plan);
  const CellResult alone = one.fit({0.4, 2, 2});
  plan.noise_mm = {0.8, 0.4};
  plan.frames = {1, 2};
  CellFitter other(study_, design_, plan);
  (void)other.fit({0.8, 1, 1});
  const CellResult among = other.fit({0.4, 2, 2});
  ASSERT_TRUE(alone.converged);
  EXPECT_NEAR(alone.value[0], among.value[0], 1e-6);
  EXPECT_NE(alone.value[0], one.fit({0.4, 2, 1}).value[0]);
  EXPECT_EQ(cells_of(plan).size(), 12U);  // two repeats and one without noise
}

TEST_F(CoarseGel, TheSpreadIsWhatTheStandardErrorsSay) {
  const MonteCarloPlan plan{.noise_mm = {1.6}, .frames = {2}, .repeats = 20};
  CellFitter fitter(study_, design_, plan);
  std::vector<CellResult> results;
  for (const Cell& cell : cells_of(plan))
    results.push_back(fitter.fit(cell));
  const std::vector<TableEntry> table = table_of(plan, study_, results);
  ASSERT_EQ(table.size(), 1U);
  for (const TableEntry& entry : table) {
    EXPECT_EQ(entry.refits, 20);
    EXPECT_EQ(entry.failed, 0);
    const ParameterSpread& C1 = entry.parameters.at(0);
    EXPECT_NEAR(C1.sd / C1.mean_se, 1, 0.5);  // 0.1 % tails of 20 repeats
    EXPECT_NEAR(C1.mean, 8.71, 3.3 * C1.mean_se / std::sqrt(20));
    EXPECT_GE(C1.coverage, 0.75);
    EXPECT_DOUBLE_EQ(C1.sd_percent, 100 * C1.sd / C1.mean);
  }
}

/// The shape that 2 kPa made, and one frame at 3 kPa: the stiffness follows the difference of the two pressures.
TEST_F(CoarseGel, AShapeThatWasImagedUnderLoadIsUnloadedInEachRefit) {
  study_.imaged_at = ImagedLoad{2.0, 0.05};
  const auto entry = [&](bool unload, bool exact_pressures, int repeats) {
    const MonteCarloPlan plan{.noise_mm = {0.1},
                              .frames = {1},
                              .repeats = repeats,
                              .exact_pressures = exact_pressures,
                              .unload = unload};
    CellFitter fitter(study_, design_, plan);
    std::vector<CellResult> results;
    for (const Cell& cell : cells_of(plan))
      results.push_back(fitter.fit(cell));
    return table_of(plan, study_, results).at(0);
  };
  const TableEntry unloaded = entry(true, false, 8);
  ASSERT_EQ(unloaded.refits, 8);
  const ParameterSpread& C1 = unloaded.parameters[0];
  EXPECT_NEAR(C1.mean, 8.71, 3.3 * C1.mean_se / std::sqrt(8));
  // 0.1 % tails of chi-square with 7 freedoms.
  EXPECT_GT(C1.sd / C1.mean_se, std::sqrt(0.60 / 7));
  EXPECT_LT(C1.sd / C1.mean_se, std::sqrt(24.3 / 7));
  EXPECT_GT(C1.bound, 1.5 * entry(true, true, 2).parameters[0].bound);
  EXPECT_LT(entry(false, false, 2).parameters[0].bound, 0.7 * C1.bound);
}

TEST_F(CoarseGel, RepeatZeroHasNoNoiseAndTellsTheBound) {
  const MonteCarloPlan plan{.noise_mm = {0.1}, .frames = {2}, .repeats = 2};
  CellFitter fitter(study_, design_, plan);
  std::vector<CellResult> results;
  for (const Cell& cell : cells_of(plan))
    results.push_back(fitter.fit(cell));
  EXPECT_NEAR(results[0].value[0], 8.71, 1e-6);
  const TableEntry entry = table_of(plan, study_, results).at(0);
  EXPECT_EQ(entry.refits, 2);
  EXPECT_DOUBLE_EQ(entry.parameters[0].bound, results[0].se[0]);
  EXPECT_NEAR(entry.parameters[0].bound / entry.parameters[0].mean_se, 1, 0.05);
}

TEST(TagGridOfImages, HasAPointAPixelAlongEveryStripeInTheWall) {
  AnnulusShape shape;
  shape.elements = {8, 4, 1};
  const HermiteMesh mesh = make_annulus(shape);
  const TagGrid grid{.stripe_mm = 5, .pixel_mm = 1, .short_axis_images = 2, .long_axis_images = 3};
  const auto places = grid_places(mesh, grid);
  // A point stands for 5 mm by 1 mm of the wall in an image, in each of two families.
  const double area_mm2 = 2 * M_PI * (50.0 * 50.0 - 22.5 * 22.5) + 3 * 2 * 27.5 * 85.0;
  EXPECT_NEAR(static_cast<double>(places.size()) / (2 * area_mm2 / 5), 1, 0.02);
  for (const auto& X : places) {
    const double radius_mm = std::hypot(X[0], X[1]);
    EXPECT_GT(radius_mm, 22.4);
    EXPECT_LT(radius_mm, 50.1);
  }
  const Measurement design = imaged_design(mesh, grid, {{0, 0, 0}, {1, 1, 0}, {2, 2, 0}});
  EXPECT_EQ(design.points.size(), 2 * places.size());
}

TEST_F(CoarseGel, FailedRefitsAreCounted) {
  const MonteCarloPlan plan{.noise_mm = {0.8}, .frames = {1}, .repeats = 3};
  const std::vector<CellResult> results{{{0.8, 1, 1}, true, 3, 1, {8.0}, {1.0}},
                                        {{0.8, 1, 2}, false, 3, 1, {}, {}},
                                        {{0.8, 1, 3}, true, 3, 1, {10.0}, {1.0}},
                                        {{0.8, 2, 3}, true, 3, 1, {99.0}, {1.0}}};
  const TableEntry entry = table_of(plan, study_, results).at(0);
  EXPECT_EQ(entry.refits, 2);
  EXPECT_EQ(entry.failed, 1);
  EXPECT_DOUBLE_EQ(entry.parameters[0].mean, 9);
  EXPECT_NEAR(entry.parameters[0].sd, std::sqrt(2.0), 1e-12);
}

TEST_F(CoarseGel, PointsThatAreNotOnTheSpecimenAreRefusedBeforeAnyRefit) {
  for (ObservedPoint& point : design_.points) {
    for (double& X_mm : point.X_mm)
      X_mm /= 10;
  }
  for (TagPoint& tag : design_.tags)
    tag.plane_mm /= 10;
  design_.tags.resize(10);
  EXPECT_THAT(
      test::message_of([&] { CellFitter(study_, design_, {}); }),
      testing::AllOf(testing::HasSubstr("gel.study.toml"), testing::HasSubstr("lie on the specimen")));
}

}  // namespace
}  // namespace diastole
