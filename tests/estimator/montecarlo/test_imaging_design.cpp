#include "estimator/montecarlo/imaging_design.hpp"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "estimator/fit/study_fit.hpp"
#include "estimator/model/study_model.hpp"
#include "estimator/montecarlo/synthetic_data.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

class ImagingDesign : public testing::Test {
 protected:
  ImagingDesign() {
    study_.file = "gel.study.toml";
    study_.specimen = AnnulusSpecimen{22.5, 50, 85, {4, 2, 1}, "fixed"};
    study_.law = {"neo-hookean", {{"C1_kPa", 8.71, 1.0, 15.0, Variation::whole}}};
    frames_ = {{0, 0, 0}, {0.012, 0.002, 0.02}, {0.2, 1.0, 0.02}, {0.4, 2.5, 0.02}, {0.6, 3.0, 0.02}};
  }

  Study study_;
  std::vector<Frame> frames_;
};

TEST_F(ImagingDesign, WithoutErrorsOfPressureTheNoiseSetsTheScale) {
  for (Frame& frame : frames_)
    frame.sigma_kPa = 0;
  const double usual = explore_imaging(study_, frames_, {}).se_percent[0];
  const double better = explore_imaging(study_, frames_, {.snr = 40}).se_percent[0];
  EXPECT_NEAR(better / usual, 0.5, 0.01);
  // Twice the pixel's side is a quarter of the pixels, and a wider edge.
  const double fine = explore_imaging(study_, frames_, {.pixel_mm = 0.8}).se_percent[0];
  const double coarse = explore_imaging(study_, frames_, {.pixel_mm = 1.6}).se_percent[0];
  EXPECT_GT(coarse / fine, 2.0);
  EXPECT_LT(coarse / fine, 2.6);
}

TEST_F(ImagingDesign, PredictsTheErrorOfAFitOfSuchImages) {
  const ImagingPlan plan{.long_axis_deg = {20}};
  const double predicted = explore_imaging(study_, frames_, plan).se_percent[0];
  ElasticModel model = make_model(study_);
  std::vector<NodeField> motions(1);
  for (size_t k = 1; k < frames_.size(); ++k)
    motions.push_back(model.solve(frames_[k].pressure_kPa).state.position_mm);
  const Measurement exact = exact_measurement(model.mesh(), planned_tags(model.mesh(), plan, frames_),
                                              motions, locator_for(study_.specimen));
  const std::vector<int> all{1, 2, 3, 4};
  std::mt19937_64 generator(5);
  Measurement noisy = with_noise(exact, all, {}, generator);
  noisy.planes_as_seen = true;
  const FitRecord fit = fit_study(study_, noisy, {});
  const FittedParameter& C1 = fit.parameters[0];
  // The fit's own interval is widened where patches pull alike, by some per cent on data without any such thing.
  EXPECT_NEAR(100 * C1.se / C1.value, predicted, 0.15 * predicted);
  EXPECT_LT(std::abs(C1.value - 8.71), 3.5 * C1.se);
}

TEST_F(ImagingDesign, ListsChangesFromTheBestToTheWorst) {
  const DesignStudy design = explore_imaging(study_, frames_, {});
  ASSERT_GT(design.options.size(), 8U);
  EXPECT_TRUE(std::is_sorted(design.options.begin(), design.options.end(),
                             [](const auto& a, const auto& b) { return a.volume < b.volume; }));
  const auto change = [&](const std::string& words) {
    return std::find_if(design.options.begin(), design.options.end(),
                        [&](const DesignOption& option) { return option.change == words; })
        ->volume;
  };
  EXPECT_LT(change("signal to noise 40"), 1);
  EXPECT_GT(change("one direction of tags"), 1);
  EXPECT_GT(change("half the phases"), 1);
  EXPECT_LT(change("twice the phases"), 1);
}

TEST_F(ImagingDesign, RefusesAPlanThatMissesTheSpecimen) {
  EXPECT_THAT(test::message_of([&] { (void)explore_imaging(study_, frames_, {.short_axis_mm = {80}}); }),
              testing::HasSubstr("sees 0 points"));
}

TEST_F(ImagingDesign, PlansNoTagsThatPixelsCannotShow) {
  EXPECT_THAT(
      test::message_of([&] { (void)explore_imaging(study_, frames_, {.tag_spacing_mm = 5, .pixel_mm = 2}); }),
      testing::HasSubstr("tags every 5 mm are less than three pixels of 2 mm apart"));
  for (const DesignOption& option : explore_imaging(study_, frames_, {.pixel_mm = 1.5}).options)
    EXPECT_NE(option.change, "tags every 3.5 mm");
}

}  // namespace
}  // namespace diastole
