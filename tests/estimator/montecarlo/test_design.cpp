#include "estimator/montecarlo/design.hpp"

#include <gmock/gmock.h>

#include <cmath>

#include "estimator/montecarlo/montecarlo.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

class GelDesign : public testing::Test {
 protected:
  GelDesign() {
    study_.file = "gel.study.toml";
    study_.specimen = AnnulusSpecimen{22.5, 50, 85, {4, 2, 1}, "fixed"};
    study_.law = {"neo-hookean", {{"C1_kPa", 8.71, 1.0, 15.0, Variation::whole}}};
    measurement_.frames = {{0, 0, 0}, {0.1, 1.0, 0.05}, {0.2, 3.0, 0.05}};
    for (int frame = 1; frame <= 2; ++frame) {
      for (int i = 0; i < 40; ++i) {
        const double angle = 0.7 * i, radius_mm = 25 + i % 20;
        const std::array<double, 3> X{radius_mm * std::cos(angle), radius_mm * std::sin(angle),
                                      -35 + 1.7 * i};
        measurement_.points.push_back({frame, X, X, 0.5});
      }
    }
  }
  const DesignOption& option(const DesignStudy& design, const std::string& change) const {
    for (const DesignOption& option : design.options) {
      if (option.change.starts_with(change)) return option;
    }
    ADD_FAILURE() << change;
    return design.options.front();
  }
  Study study_;
  Measurement measurement_;
};

// In a neo-Hookean body motion depends on P / C1 alone: se² = 1 / sum over frames of 1 / (s_f² + (sigma / P_f)²), s_f the
// error at exact pressure; doubling the points halves s_f².
TEST_F(GelDesign, PredictionsAreWhatTheoryAndEachOtherSay) {
  const DesignStudy design = explore_design(study_, measurement_);
  const double exact = option(design, "pressures known exactly").se_percent[0];
  const double with_1 = option(design, "without frame 2").se_percent[0];
  const double with_3 = option(design, "without frame 1").se_percent[0];
  const double information = 1 / (with_1 * with_1) + 1 / (with_3 * with_3);
  EXPECT_NEAR(design.se_percent[0], 1 / std::sqrt(information), 1e-6);
  EXPECT_GT(with_1, 5.0);  // the pressure's error alone is 5 %
  EXPECT_GT(with_3, 5.0 / 3);
  EXPECT_LT(exact, design.se_percent[0]);
  const double half_spacing = option(design, "half the tag").se_percent[0];
  EXPECT_LT(half_spacing, design.se_percent[0]);
  EXPECT_LT(option(design, "half the points' noise").se_percent[0], half_spacing);
  // The same frame again, as a new one with a pressure reading of its own, tells twice as much.
  const double again = option(design, "one more frame at 3 kPa").se_percent[0];
  EXPECT_NEAR(1 / (again * again), information + 1 / (with_3 * with_3), 0.02 * information);
  EXPECT_LT(option(design, "one more frame at 4.5 kPa").se_percent[0], again);
  for (const DesignOption& change : design.options)
    EXPECT_NEAR(change.volume, change.se_percent[0] / design.se_percent[0], 1e-6) << change.change;
}

/// What is predicted of a shape that was imaged under load is what a fit of such data says of itself.
TEST_F(GelDesign, AnImagedLoadIsEliminatedAsTheFitDoes) {
  study_.imaged_at = ImagedLoad{1.8, 0.1};
  measurement_.frames[1].pressure_kPa = 2.4;
  for (ObservedPoint& point : measurement_.points)
    point.sigma_mm = 0.25;
  const DesignStudy design = explore_design(study_, measurement_, true);
  MonteCarloPlan plan{.frames = {2}, .repeats = 2, .unload = true};
  const auto bound_percent = [&] {
    return 100 * CellFitter(study_, measurement_, plan).fit({0, 2, 0}).se[0] / 8.71;
  };
  EXPECT_NEAR(design.se_percent[0], bound_percent(), 0.02 * design.se_percent[0]);
  plan.exact_pressures = true;
  const double exact = option(design, "pressures known exactly").se_percent[0];
  EXPECT_NEAR(exact, bound_percent(), 0.02 * exact);
  EXPECT_LT(exact, 0.8 * design.se_percent[0]);
  EXPECT_GT(std::abs(explore_design(study_, measurement_).se_percent[0] / design.se_percent[0] - 1), 0.05);
  study_.imaged_at.reset();
  EXPECT_THAT(test::message_of([&] { (void)explore_design(study_, measurement_, true); }),
              testing::HasSubstr("imaged_at_kPa"));
}

TEST_F(GelDesign, TheBestChangeStandsFirst) {
  const DesignStudy design = explore_design(study_, measurement_);
  for (size_t i = 1; i < design.options.size(); ++i)
    EXPECT_LE(design.options[i - 1].volume, design.options[i].volume);
  EXPECT_THAT(design.options.back().change, testing::HasSubstr("without frame 2"));
}

TEST_F(GelDesign, DataThatSayNothingAreRefused) {
  const auto message = [&] { return test::message_of([&] { (void)explore_design(study_, measurement_); }); };
  const Measurement sound = measurement_;
  for (ObservedPoint& point : measurement_.points)
    point.frame = 0;
  EXPECT_THAT(message(), testing::HasSubstr("every measured point is of frame 0"));
  measurement_ = sound;
  for (ObservedPoint& point : measurement_.points) {
    for (double& X_mm : point.X_mm)
      X_mm /= 10;
  }
  EXPECT_THAT(message(),
              testing::AllOf(testing::HasSubstr("only 0 of 80"), testing::HasSubstr("gel.study.toml")));
  measurement_ = sound;
  for (Frame& frame : measurement_.frames)
    frame.pressure_kPa = 0;
  EXPECT_THAT(message(), testing::HasSubstr("says nothing about C1_kPa"));
}

}  // namespace
}  // namespace diastole
