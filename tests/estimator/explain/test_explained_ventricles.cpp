// Effects hidden in simulated ventricles: each is named with its size, none where nothing is hidden, and what no effect of the library is
// stays unexplained. The ventricles are solved on another mesh than they are explained on, but by the same equations.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/explain/imaging/explain_field.hpp"
#include "tests/estimator/explain/simulated_ventricle.hpp"

namespace diastole::explain {
namespace {

struct Case {
  const char* name;
  test::SimulatedVentricle ventricle;
  Verdict verdict;
  std::vector<std::string> effects = {};
  const char* parameter = "";
  double value = 0.0;
  double within = 0.0;
};

FieldModel changed(void (*change)(FieldModel&)) {
  FieldModel model;
  change(model);
  return model;
}

FieldModel infarct(double contrast, double theta_deg, double z_mm, double axis_mm = 12.0) {
  FieldModel model;
  model.inclusion = Inclusion{.contrast = contrast,
                              .radius_mm = 23.0,
                              .z_mm = z_mm,
                              .theta_deg = theta_deg,
                              .semi_axes_mm = {axis_mm, axis_mm, axis_mm}};
  return model;
}

std::string name_of(const testing::TestParamInfo<Case>& info) { return info.param.name; }

class Ventricle : public testing::TestWithParam<Case> {};

TEST_P(Ventricle, IsExplained) {
  const Case& hidden = GetParam();
  const Study study = test::simulated(
      hidden.ventricle, std::filesystem::path(testing::TempDir()) / "explained-ventricles" / hidden.name);
  const Explanation found = explain_field(study);
  std::vector<std::string> ids;
  for (const FoundEffect& effect : found.effects)
    ids.push_back(effect.id);
  SCOPED_TRACE(found.summary);
  EXPECT_EQ(name_of(found.verdict), name_of(hidden.verdict));
  EXPECT_EQ(ids, hidden.effects);
  RecordProperty("seconds", std::to_string(found.seconds));
  if (hidden.parameter[0] == '\0' || found.effects.empty()) return;
  const std::vector<FoundParameter>& parameters = found.effects.front().parameters;
  const auto size = std::ranges::find(parameters, hidden.parameter, &FoundParameter::name);
  ASSERT_NE(size, parameters.end());
  EXPECT_NEAR(size->value, hidden.value, hidden.within);
  EXPECT_LT(size->ci90[0], size->ci90[1]);
}

INSTANTIATE_TEST_SUITE_P(
    Simulated, Ventricle,
    testing::Values(
        Case{"Nothing", {.seed = 11}, Verdict::none},
        Case{"StiffRegion", {.truth = infarct(6.0, 70.0, -10.0), .seed = 12}, Verdict::named, {"stiff-inclusion"}},
        Case{"SoftRegion", {.truth = infarct(0.25, -100.0, -25.0), .seed = 13}, Verdict::named, {"stiff-inclusion"}},
        Case{"TurnedFibres",
             {.truth = changed([](FieldModel& model) { model.fibre_turn_deg = 10.0; }), .seed = 14},
             Verdict::named,
             {"fibre-turn"},
             "angle_deg",
             10.0,
             3.0},
        Case{"AnotherCourse",
             {.truth = changed([](FieldModel& model) { model.fibre_course_deg = -15.0; }), .seed = 15},
             Verdict::named,
             {"fibre-course"},
             "angle_deg",
             -15.0,
             5.0},
        Case{"ResidualStress",
             {.truth = changed([](FieldModel& model) { model.opening_angle_deg = 60.0; }), .seed = 16},
             Verdict::named,
             {"residual-stress"},
             "opening_angle_deg",
             60.0,
             20.0},
        Case{"MovingBase",
             {.truth = changed([](FieldModel& model) { model.base_motion_mm_per_kPa = {0.2, -0.1, 0.3}; }), .seed = 17},
             Verdict::named,
             {"base-motion"},
             "z_mm_per_kPa",
             0.3,
             0.03},
        Case{"PressureOffset",
             {.truth = changed([](FieldModel& model) { model.pressure_offset_kPa = 0.15; }), .seed = 18},
             Verdict::named,
             {"sensor-offset"},
             "offset_kPa",
             0.15,
             0.05},
        Case{"AddedFibres",
             {.truth = changed([](FieldModel& model) {
                model.k1_kPa = 8.0;
                model.fibre_angle_deg = 60.0;
              }),
              .seed = 19},
             Verdict::named,
             {"fibre-anisotropy"}},
        Case{"Twist", {.twist_deg = 1.5, .seed = 20}, Verdict::unexplained},
        Case{"Sag", {.sag_mm = 1.0, .seed = 21}, Verdict::unexplained}),
    name_of);

}  // namespace
}  // namespace diastole::explain
