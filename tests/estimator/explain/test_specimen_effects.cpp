// Effects of any specimen, on a ventricle: neutral, and differentiable.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "estimator/explain/imaging/explain_field.hpp"
#include "estimator/explain/imaging/imaged_specimen.hpp"
#include "estimator/fit/changed_motion.hpp"
#include "estimator/mesh/node_field.hpp"
#include "estimator/model/changed_specimen.hpp"
#include "tests/estimator/explain/simulated_ventricle.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

class EverySpecimenEffect : public testing::TestWithParam<const Effect*> {
 protected:
  static Study small_ventricle() {
    const test::ScratchFolder folder;
    Study study = test::simulated({.points = 1, .mesh = "4, 3, 1"}, folder.path());
    std::get<EllipsoidSpecimen>(study.specimen).mesh = {4, 3, 1};
    return study;
  }
  const ChangeableSpecimen specimen_{small_ventricle()};

  /// The seen motion at 1 kPa with the effect at these values, or its derivative by the first of them.
  ChangedMotion motion(std::vector<double> values) const {
    const Effect& effect = *GetParam();
    std::vector<double> steps;
    for (const EffectParameter& parameter : effect.field_parameters())
      steps.push_back(1e-3 * std::abs(parameter.typical));
    return {{.body = [this](const FieldModel& change) { return specimen_.with(change); },
             .change =
                 [&effect](std::span<const double> unknown) {
                   FieldModel change;
                   effect.apply_to_field(unknown, change);
                   return change;
                 },
             .steps = std::move(steps)},
            {},
            std::move(values)};
  }
  std::vector<double> typical() const {
    std::vector<double> values;
    for (const EffectParameter& parameter : GetParam()->field_parameters())
      values.push_back(parameter.typical);
    if (GetParam()->is_inclusion()) values = {3.0, 25.0, -10.0, 45.0, 12.0, 12.0, 12.0};
    return values;
  }
};

TEST_P(EverySpecimenEffect, AtNeutralValuesIsTheBaseModel) {
  ASSERT_TRUE(specimen_.takes(*GetParam()));
  FieldModel change;
  GetParam()->apply_to_field(GetParam()->field_neutral(change), change);
  EXPECT_EQ(change, FieldModel{});
}

TEST_P(EverySpecimenEffect, HasTheDerivativesOfItsMotion) {
  std::vector<double> values = typical();
  ChangedMotion at = motion(values);
  ASSERT_TRUE(at.solve(0, values, 1.0).position_mm);
  const MotionDerivatives by = at.derivatives(0);
  for (size_t i = 0; i < values.size(); ++i) {
    const double step = 1e-2 * std::abs(GetParam()->field_parameters()[i].typical);
    const auto moved = [&](double change) {
      std::vector<double> there = values;
      there[i] += change;
      return *at.solve(0, there, 1.0).position_mm;
    };
    NodeField difference_mm = difference(moved(step), moved(-step));
    double largest = 0.0, error = 0.0;
    for (size_t dof = 0; dof < difference_mm.size(); ++dof) {
      const double expected = difference_mm[dof] / (2.0 * step);
      largest = std::max(largest, std::abs(expected));
      error = std::max(error, std::abs(by.by_value[i][dof] - expected));
    }
    EXPECT_GT(largest, 0.0);
    EXPECT_LT(error, 0.02 * largest) << GetParam()->field_parameters()[i].name;
  }
}

std::string id_of(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}
INSTANTIATE_TEST_SUITE_P(List, EverySpecimenEffect, testing::ValuesIn(specimen_effects()), id_of);

/// A small ventricle, explained on twice as few elements each way as it was solved on.
explain::Explanation explained(const FieldModel& truth) {
  const test::ScratchFolder folder;
  Study study = test::simulated({.truth = truth, .points = 400, .seed = 3, .mesh = "8, 6, 2"}, folder.path());
  std::get<EllipsoidSpecimen>(study.specimen).mesh = {4, 3, 1};
  return explain::explain_field(study);
}

TEST(SmallVentricle, WithNothingHiddenIsGivenNoName) {
  const explain::Explanation found = explained({});
  EXPECT_EQ(found.verdict, explain::Verdict::none) << found.summary;
  EXPECT_TRUE(found.effects.empty());
}

TEST(SmallVentricle, WithoutLoadIsRefused) {
  const test::ScratchFolder folder;
  const Study study = test::simulated({.points = 50, .mesh = "4, 3, 1"}, folder.path());
  folder.write("lv.frames.csv",
               "frame,time_s,pressure_kPa,sigma_kPa\n0,0,0,0.01\n1,0.1,0,0.01\n2,0.2,0,0.01\n3,0.3,0,0.01\n"
               "4,0.4,0,0.01\n5,0.5,0,0.01\n");
  EXPECT_NE(test::message_of([&] { (void)explain::explain_field(study); }).find("inflated"),
            std::string::npos);
}

TEST(SmallVentricle, WithPressuresThatAreOffIsExplainedAndItsStiffnessMended) {
  FieldModel truth;
  truth.pressure_offset_kPa = 0.2;
  const explain::Explanation found = explained(truth);
  ASSERT_EQ(found.verdict, explain::Verdict::named) << found.summary;
  ASSERT_EQ(found.effects.front().id, "sensor-offset");
  const explain::FoundParameter& offset = found.effects.front().parameters.front();
  EXPECT_NEAR(offset.value, 0.2, 4.0 * offset.standard_error);
  EXPECT_LT(offset.standard_error, 0.05);
  EXPECT_LT(found.gap.after, 0.5 * found.gap.before);
  const explain::ParameterShift& C = found.shifts.front();
  EXPECT_NEAR(C.after, 3.0, 3.0 * C.after_error);
}

TEST(AnySpecimen, BeginsStifferWhereTheStartCarriesNoLoad) {
  const test::ScratchFolder folder;
  Study study = test::simulated({.points = 100, .mesh = "4, 3, 1"}, folder.path());
  std::get<EllipsoidSpecimen>(study.specimen).mesh = {4, 3, 1};
  set_start(study, "C_kPa=0.2");
  std::string said;
  const auto specimen = explain::any_specimen(study, [&](const std::string& text) { said += text; });
  specimen->fit_base();
  EXPECT_THAT(said, testing::HasSubstr("the body does not carry the pressures: the search began at"));
  EXPECT_NEAR(specimen->base().chi_square / static_cast<double>(specimen->rows().size()), 1.0, 0.3);
}

}  // namespace
}  // namespace diastole
