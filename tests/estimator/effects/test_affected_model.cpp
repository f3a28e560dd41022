// Studies whose [model] names effects can be solved and fitted.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "estimator/effects/effect.hpp"
#include "estimator/fit/study_motion.hpp"
#include "estimator/model/affected_model.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

Study gel(std::vector<std::string> effects, std::vector<StudyEffect> values = {}) {
  Study study;
  AnnulusSpecimen annulus;
  annulus.inner_radius_mm = 22.5;
  annulus.outer_radius_mm = 50.0;
  annulus.height_mm = 85.0;
  annulus.mesh = {4, 3, 1};
  annulus.ends = "fixed";
  study.specimen = annulus;
  study.law.name = "neo-hookean";
  StudyParameter C1{};
  C1.name = "C1_kPa";
  C1.start = 8.0;
  C1.lower = 1.0;
  C1.upper = 15.0;
  study.law.parameters = {C1};
  study.effects = std::move(effects);
  study.effect_values = std::move(values);
  return study;
}

/// An effect at its typical values.
Study gel_with(const Effect& effect) {
  StudyEffect typical{std::string(effect.text().id), {}, {}};
  for (const EffectParameter& parameter : effect.field_parameters())
    typical.starts[std::string(parameter.name)] = parameter.typical;
  return gel({typical.id}, {typical});
}

double volume_change_mL(const Study& study) {
  ElasticModel model = make_affected_model(study);
  const Solution solution = model.solve(2.0);
  EXPECT_TRUE(solution.report.converged()) << solution.report.describe();
  return model.cavity_volume_mL(solution.state) - model.cavity_volume_mL(model.rest_state());
}

class EveryImagedEffect : public testing::TestWithParam<const Effect*> {};

TEST_P(EveryImagedEffect, ChangesWhatASpecimenTakesOrWhatImagesShow) {
  const Study study = gel_with(*GetParam());
  const double change_mL = volume_change_mL(study) - volume_change_mL(gel({}));
  if (GetParam()->text().id == "tag-bias") {
    EXPECT_DOUBLE_EQ(field_change_of(study).displacement_gain, 0.95);
    EXPECT_EQ(change_mL, 0.0);
  } else {
    EXPECT_GT(std::abs(change_mL), 0.01);
  }
}

TEST_P(EveryImagedEffect, IsTheStudyItselfWhereNoValueIsStated) {
  EXPECT_DOUBLE_EQ(volume_change_mL(gel({std::string(GetParam()->text().id)})), volume_change_mL(gel({})));
}

std::string test_name(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}
INSTANTIATE_TEST_SUITE_P(List, EveryImagedEffect, testing::ValuesIn(field_effects()), test_name);

TEST(AffectedModel, LeavesTheSpecimenWhereOnlyTheRigIsConcerned) {
  EXPECT_EQ(volume_change_mL(gel({"hose-compliance"})), volume_change_mL(gel({})));
}

TEST(AffectedModel, SaysWhichEffectsOfTheSpecimenRecordingsAloneShow) {
  const std::vector<Finding> found = model_findings(gel({"viscoelasticity", "hose-compliance"}));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].id, "effect-of-recordings");
  EXPECT_TRUE(found[0].what.starts_with("viscoelasticity "));
  EXPECT_TRUE(model_findings(gel({})).empty());
}

TEST(AffectedModel, GelHasOffsetsOfTheRigAndNoFibres) {
  EXPECT_FALSE(shows_in_images(gel({"sensor-offset"})));
  EXPECT_EQ(volume_change_mL(gel({"sensor-offset"})), volume_change_mL(gel({})));
  EXPECT_THROW(make_affected_model(gel({"fibre-turn"})), InputError);
  EXPECT_THROW(make_affected_model(gel({"residual-stress"})), InputError);
}

TEST(AffectedModel, RefusesUnknownEffectsAndOtherSpecimens) {
  EXPECT_THROW(make_affected_model(gel({"gravity-waves"})), InputError);
  Study sprung = gel({"radius-error"});
  std::get<AnnulusSpecimen>(sprung.specimen).ends = "sprung";
  EXPECT_THROW(make_affected_model(sprung), InputError);
}

TEST(AffectedModel, IsSeenWithItsGain) {
  const auto motion = [](const Study& study) {
    return study_motion(study, make_affected_model(study), {whole_parameter(0)}, false);
  };
  const std::unique_ptr<ElasticMotion> plain = motion(gel({}));
  const std::unique_ptr<ElasticMotion> seen = motion(gel({"tag-bias"}, {{"tag-bias", {{"gain", 0.9}}, {}}}));
  const double C1_kPa = 8.0;
  const NodeField true_mm = *plain->solve(0, {&C1_kPa, 1}, 2.0).position_mm;
  const NodeField seen_mm = *seen->solve(0, {&C1_kPa, 1}, 2.0).position_mm;
  const NodeField& still_mm = plain->mesh().reference();
  const MotionDerivatives truly = plain->derivatives(0);
  const MotionDerivatives apparently = seen->derivatives(0);
  const size_t most = static_cast<size_t>(
      std::max_element(truly.by_pressure.begin(), truly.by_pressure.end()) - truly.by_pressure.begin());
  EXPECT_NEAR(seen_mm[most] - still_mm[most], 0.9 * (true_mm[most] - still_mm[most]), 1e-12);
  EXPECT_NEAR(apparently.by_pressure[most], 0.9 * truly.by_pressure[most], 1e-12);
  EXPECT_NEAR(apparently.by_value[0][most], 0.9 * truly.by_value[0][most], 1e-12);
}

}  // namespace
}  // namespace diastole
