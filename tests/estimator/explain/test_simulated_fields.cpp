// Explanations of simulated images with other parameters than the recorded sets: what must never be named, and what must.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "estimator/explain/imaging/explain_field.hpp"
#include "tests/estimator/explain/simulated_tags.hpp"

namespace diastole::explain {
namespace {

struct Hidden {
  const char* name;
  SimulatedTags tags;
  Verdict verdict;
  std::vector<std::string> ids = {};  ///< named, or one of the sets left open
};

FieldModel slipping(double bond_kPa_per_mm) {
  FieldModel model;
  model.bond_stiffness_kPa_per_mm = bond_kPa_per_mm;
  return model;
}

FieldModel fibrous(double k1_kPa, double angle_deg) {
  FieldModel model;
  model.k1_kPa = k1_kPa;
  model.fibre_angle_deg = angle_deg;
  return model;
}

FieldModel with_inclusion() {
  FieldModel model;
  model.inclusion = Inclusion{.contrast = 0.35,
                              .radius_mm = 35.0,
                              .z_mm = -14.0,
                              .theta_deg = 310.0,
                              .semi_axes_mm = {10.0, 12.0, 9.0}};
  return model;
}

FieldModel stiffening_and_slipping() {
  FieldModel model = slipping(3.0);
  model.beta = 7.4;
  return model;
}

FieldModel seen_with(double gain) {
  FieldModel model;
  model.displacement_gain = gain;
  return model;
}

std::vector<Hidden> hidden() {
  return {
      {"Nothing", {.C1_kPa = 9.8, .highest_kPa = 3.8, .seed = 101}, Verdict::none},
      {"NothingSeenCoarsely",
       {.C1_kPa = 6.4, .highest_kPa = 2.1, .sigma_mm = 0.35, .seed = 102},
       Verdict::none},
      {"NothingBesideAKnownC1", {.C1_kPa = 7.3, .C1_known = true, .seed = 103}, Verdict::none},
      {"Bias", {.truth = seen_with(1.05), .C1_kPa = 7.3, .seed = 104}, Verdict::none},
      {"BiasBesideAKnownC1",
       {.truth = seen_with(1.05), .C1_kPa = 7.3, .C1_known = true, .seed = 105},
       Verdict::ambiguous,
       {"tag-bias"}},
      {"Twist",
       {.outside = {.twist_deg = -0.8}, .C1_kPa = 9.5, .sigma_mm = 0.35, .seed = 106},
       Verdict::unexplained},
      {"Shift",
       {.outside = {.shift_mm = {0.5, -0.3}}, .C1_kPa = 6.1, .highest_kPa = 1.9, .seed = 107},
       Verdict::unexplained},
      {"Sag",
       {.outside = {.body_force_kPa_per_mm = 0.005}, .C1_kPa = 9.3, .seed = 108},
       Verdict::unexplained},
      {"Slip", {.truth = slipping(4.0), .seed = 109}, Verdict::named, {"end-bond-slip"}},
      {"Fibres",
       {.truth = fibrous(4.0, 105.0), .C1_kPa = 6.3, .highest_kPa = 2.1, .seed = 110},
       Verdict::named,
       {"fibre-anisotropy"}},
      {"Inclusion", {.truth = with_inclusion(), .seed = 111}, Verdict::named, {"stiff-inclusion"}},
      {"SlipAndStiffening",
       {.truth = stiffening_and_slipping(), .C1_kPa = 7.2, .highest_kPa = 2.7, .seed = 112},
       Verdict::named,
       {"end-bond-slip", "strain-stiffening"}},
  };
}

class SimulatedImages : public testing::TestWithParam<Hidden> {};

TEST_P(SimulatedImages, AreExplained) {
  const Explanation explanation = explain_field(simulated_tags(GetParam().tags), GetParam().name);
  EXPECT_EQ(name_of(explanation.verdict), name_of(GetParam().verdict)) << explanation.summary;
  std::vector<std::string> ids;
  for (const FoundEffect& effect : explanation.effects) {
    ids.push_back(effect.id);
    for (const FoundParameter& parameter : effect.parameters)  // those that were not freed, too
      EXPECT_LT(parameter.ci90[0], parameter.ci90[1]) << effect.id << " " << parameter.name;
  }
  const bool inside =
      ids == GetParam().ids || std::ranges::count(explanation.ambiguous_with, GetParam().ids) > 0;
  EXPECT_TRUE(inside) << explanation.summary;
  EXPECT_EQ(explanation.next_experiment.has_value(), explanation.verdict != Verdict::none);
}

TEST(SimulatedLoads, OneOfWhosePressuresIsWrongAreUnexplained) {
  FieldCase field = simulated_tags({.C1_kPa = 9.8, .highest_kPa = 3.8, .seed = 101});
  field.measurement.frames[3].pressure_kPa *= 1.1;
  const Explanation explanation = explain_field(std::move(field), "pressure");
  EXPECT_EQ(name_of(explanation.verdict), name_of(Verdict::unexplained)) << explanation.summary;
  ASSERT_FALSE(explanation.where.empty());
  EXPECT_EQ(explanation.where.front().channel, "pressures");
  EXPECT_EQ(explanation.where.front().region, "frame 3");
}

TEST(SimulatedLoads, OneOfWhichIsWrongAndStatedAsSureSaysWhich) {
  FieldCase field = simulated_tags({.C1_kPa = 9.8, .highest_kPa = 3.8, .seed = 101});
  field.measurement.frames[3].pressure_kPa *= 1.1;
  for (Frame& frame : field.measurement.frames)
    frame.sigma_kPa *= 0.1;  // so that the motion has to follow the readings
  const Explanation explanation = explain_field(std::move(field), "pressure");
  EXPECT_EQ(name_of(explanation.verdict), name_of(Verdict::unexplained)) << explanation.summary;
  EXPECT_THAT(explanation.summary, testing::HasSubstr("Frame 3 was at"));
}

std::string name_of_case(const testing::TestParamInfo<Hidden>& info) { return info.param.name; }
INSTANTIATE_TEST_SUITE_P(Sets, SimulatedImages, testing::ValuesIn(hidden()), name_of_case);

}  // namespace
}  // namespace diastole::explain
