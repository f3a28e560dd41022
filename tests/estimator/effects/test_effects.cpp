// What every effect of the list must keep.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

#include "estimator/rig_fit/model_term.hpp"
#include "tests/estimator/rig_fit/simulated_session.hpp"
#include "tools/benchmarks/verification/effects_page.hpp"

namespace diastole {
namespace {

using rig::RigModel;

std::vector<ChangePoint> change_points_of(const Effect& effect) {
  if (effect.change_points() == ChangePoints::none) return {};
  return {{"baseline", 3.1, 63.1}};
}

std::vector<double> typical(const Effect& effect) {
  std::vector<double> values;
  for (const EffectParameter& parameter : effect.parameters())
    values.push_back(parameter.typical);
  return values;
}

class EveryEffect : public testing::TestWithParam<const Effect*> {
 protected:
  [[nodiscard]] rig::Prediction shown(const std::vector<double>* values) const {
    RigModel model;
    model.curve = family_.plain();
    model.modulus_kPa = 8.0;
    if (values != nullptr) GetParam()->apply(*values, {family_, change_points_}, model);
    return rig::observe(model, rig::simulate_plant(model, run_.drive), run_.drive.place, run_.sample_s);
  }

  rig::SpecimenFamily family_ = rig::gel_family();
  rig::SessionRun run_ = rig::empty_run("baseline", {0.0, "parabolic", 40.0, 1.2, 0.0, 2}, 60.0);
  std::vector<ChangePoint> change_points_ = change_points_of(*GetParam());
};

TEST_P(EveryEffect, TellsEverything) {
  const EffectDeclaration& text = GetParam()->text();
  for (const std::string_view part :
       {text.id, text.title, text.equations, text.source, text.looks_like, text.revealed_by})
    EXPECT_FALSE(part.empty());
  for (const auto& others : {text.conflicts, text.synergies})
    for (const std::string_view other : others)
      EXPECT_NE(find_effect(other), nullptr) << other;
  for (const EffectParameter& parameter : GetParam()->parameters()) {
    EXPECT_LE(parameter.lower, parameter.neutral) << parameter.name;
    EXPECT_LE(parameter.neutral, parameter.upper) << parameter.name;
    EXPECT_LT(parameter.lower, parameter.typical) << parameter.name;
    EXPECT_LT(parameter.typical, parameter.upper) << parameter.name;
  }
}

TEST_P(EveryEffect, IsTheBaseModelExactlyWhereNeutral) {
  const rig::Prediction base = shown(nullptr);
  const std::vector<double> neutral = GetParam()->neutral(RigModel{});
  const rig::Prediction same = shown(&neutral);
  EXPECT_EQ(same.cavity_kPa, base.cavity_kPa);
  EXPECT_EQ(same.pump_kPa, base.pump_kPa);
}

TEST_P(EveryEffect, ShowsWhereItIsTypical) {
  const rig::Prediction base = shown(nullptr);
  const std::vector<double> values = typical(*GetParam());
  const rig::Prediction other = shown(&values);
  double largest_kPa = 0.0;
  for (size_t k = 0; k < base.cavity_kPa.size(); ++k) {
    largest_kPa = std::max({largest_kPa, std::abs(other.cavity_kPa[k] - base.cavity_kPa[k]),
                            std::abs(other.pump_kPa[k] - base.pump_kPa[k])});
    ASSERT_TRUE(std::isfinite(other.cavity_kPa[k]) && std::isfinite(other.pump_kPa[k])) << k;
  }
  EXPECT_GT(largest_kPa, 0.005);
}

/// The fit's forward difference against a central one of ten times its step.
TEST_P(EveryEffect, HasTheGradientThatTheFitTakes) {
  const std::vector<double> at = typical(*GetParam());
  const rig::Prediction here = shown(&at);
  for (size_t j = 0; j < at.size(); ++j) {
    const rig::Unknown unknown = rig::unknown_of(*GetParam(), GetParam()->parameters()[j]);
    const auto moved = [&](double by) {
      std::vector<double> values = at;
      values[j] = unknown.value(unknown.coordinate(at[j]) + by);
      return shown(&values);
    };
    const rig::Prediction forward = moved(unknown.perturbation);
    const rig::Prediction up = moved(10.0 * unknown.perturbation);
    const rig::Prediction down = moved(-10.0 * unknown.perturbation);
    double difference = 0.0;
    double size = 0.0;
    for (size_t k = 0; k < here.cavity_kPa.size(); ++k) {
      for (const auto channel : {&rig::Prediction::cavity_kPa, &rig::Prediction::pump_kPa}) {
        const double slope = ((forward.*channel)[k] - (here.*channel)[k]) / unknown.perturbation;
        const double central = ((up.*channel)[k] - (down.*channel)[k]) / (20.0 * unknown.perturbation);
        difference += (slope - central) * (slope - central);
        size += central * central;
      }
    }
    EXPECT_LE(std::sqrt(difference), 0.05 * std::sqrt(size) + 1e-12) << GetParam()->parameters()[j].name;
  }
}

std::string test_name(const testing::TestParamInfo<const Effect*>& info) {
  std::string name(info.param->text().id);
  std::erase(name, '-');
  return name;
}

INSTANTIATE_TEST_SUITE_P(List, EveryEffect, testing::ValuesIn(rig_effects()), test_name);

TEST(Effects, AreThePageOfTheDocuments) {
  std::ifstream file(DIASTOLE_SOURCE_DIR "/docs/effects.md");
  const std::string page((std::istreambuf_iterator<char>(file)), {});
  EXPECT_EQ(page, effects_page()) << "build/release/bin/effects_table > docs/effects.md";
}

/// The search for a lump sets an Inclusion's seven parameters in their order.
TEST(Effects, HaveOneInclusion) {
  EXPECT_EQ(std::ranges::count_if(all_effects(), &Effect::is_inclusion), 1);
  FieldModel model;
  inclusion_effect().apply_to_field(std::vector{2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0}, model);
  EXPECT_EQ(model.inclusion, (Inclusion{2.0, 3.0, 4.0, 5.0, {6.0, 7.0, 8.0}}));
}

TEST(Effects, HaveEachTheirId) {
  std::set<std::string_view> ids;
  for (const Effect* effect : all_effects())
    EXPECT_TRUE(ids.insert(effect->text().id).second) << effect->text().id;
  EXPECT_EQ(find_effect("no-such-effect"), nullptr);
}

}  // namespace
}  // namespace diastole
