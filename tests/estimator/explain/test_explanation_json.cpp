#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "estimator/explain/verdict/explanation_json.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/estimator/explain/synthetic_explanation.hpp"

namespace diastole::explain {
namespace {

using testing::HasSubstr;

TEST(ExplanationJson, ComesBackAsItWasWritten) {
  for (const Explanation& explanation :
       {test::explained_hose(), test::explained_inclusion(), Explanation{}}) {
    const std::string text = to_json(explanation);
    EXPECT_TRUE(is_explanation(text));
    const Explanation back = explanation_from_json(text, "e.json");
    EXPECT_EQ(to_json(back), text);
    EXPECT_EQ(back.verdict, explanation.verdict);
    EXPECT_EQ(back.where.size(), explanation.where.size());
    EXPECT_EQ(back.field.size(), explanation.field.size());
  }
}

TEST(ExplanationJson, HasTheKeysOfTheContract) {
  const auto json = nlohmann::json::parse(to_json(test::explained_hose()));
  EXPECT_EQ(json.at("verdict"), "named");
  const auto& speed = json.at("effects").at(0).at("parameters").at("wave_speed_m_s");
  EXPECT_EQ(speed.at("value"), 61.2);
  EXPECT_EQ(speed.at("unit"), "m/s");
  EXPECT_EQ(speed.at("ci90"), nlohmann::json::parse("[58.0, 65.0]"));
  EXPECT_EQ(json.at("effects").at(0).at("id"), "hose-compliance");
  EXPECT_TRUE(json.at("ambiguous_with").is_array());
  const auto& place = json.at("where").at(0);
  EXPECT_EQ(place.at("port"), "drive");
  EXPECT_EQ(place.at("channel"), "pump_kPa");
  EXPECT_EQ(place.at("segment"), 2);
  EXPECT_EQ(place.at("phase"), nlohmann::json::parse("[0.4, 0.6]"));
  EXPECT_EQ(place.at("band_Hz"), nlohmann::json::parse("[2.0, 6.0]"));
  EXPECT_TRUE(place.at("region").is_null());
  EXPECT_EQ(place.at("excess_chi2"), 31.5);
  EXPECT_EQ(place.at("p_value"), 1e-9);
  for (const char* key : {"before", "after", "floor", "closed", "held_out"})
    EXPECT_TRUE(json.at("gap").contains(key)) << key;
  const auto& next = json.at("next_experiment");
  EXPECT_EQ(next.at("predicted_separation_sigma"), 7.2);
  EXPECT_EQ(next.at("separates").size(), 2U);
  EXPECT_THAT(next.at("toml"), HasSubstr("diastole-experiment"));
  EXPECT_EQ(json.at("study_after"), "explained.study.toml");
}

TEST(ExplanationJson, KeepsALearnedTerm) {
  Explanation explanation = test::explained_hose();
  EXPECT_TRUE(nlohmann::json::parse(to_json(explanation)).at("learned").is_null());
  LearnedTerm& term = explanation.learned.emplace();
  term.port = "drive";
  term.variables = {"q_hose"};
  term.curve = {{0.0, 0.0}, {50.0, 3.0}};
  term.band = {{0.0, 0.0}, {2.5, 3.5}};
  term.rivals = {{"specimen", "p", {"V"}, "learned-2.effect.toml", "id = \"learned-2\""}};
  const auto json = nlohmann::json::parse(to_json(explanation));
  for (const char* key : {"port", "variables", "curve", "band", "gap", "readings", "effect_file"})
    EXPECT_TRUE(json.at("learned").contains(key)) << key;
  EXPECT_EQ(json.at("learned").at("band"), nlohmann::json::parse("[[0.0, 0.0], [2.5, 3.5]]"));
  const Explanation again = explanation_from_json(to_json(explanation), "e.json");
  ASSERT_TRUE(again.learned.has_value());
  EXPECT_EQ(again.learned->curve, explanation.learned->curve);
  ASSERT_EQ(again.learned->rivals.size(), 1U);
  EXPECT_EQ(again.learned->rivals[0].effect_file, "learned-2.effect.toml");
}

TEST(ExplanationJson, TakesADocumentOfTheContractsKeysOnly) {
  const Explanation explanation = explanation_from_json(
      R"({"verdict": "unexplained", "effects": [{"id": "sensor-gain", "parameters": {"gain": {"value": 0.9, "ci90": [0.8, 1.0]}}}],
          "ambiguous_with": [["stroke-gain"]], "where": [{"port": "sensor", "channel": "cavity_kPa", "region": null}],
          "gap": {"before": 4, "after": 3, "floor": 1, "closed": 0.33, "held_out": []}})",
      "e.json");
  EXPECT_EQ(explanation.verdict, Verdict::unexplained);
  EXPECT_EQ(explanation.effects[0].parameters[0].name, "gain");
  EXPECT_EQ(explanation.effects[0].parameters[0].ci90[1], 1.0);
  EXPECT_EQ(explanation.ambiguous_with[0][0], "stroke-gain");
  EXPECT_FALSE(explanation.where[0].segment.has_value());
  EXPECT_FALSE(explanation.next_experiment.has_value());
}

std::string problem_of(const std::string& text) {
  try {
    explanation_from_json(text, "e.json");
  } catch (const InputError& error) {
    return error.what();
  }
  return "read";
}

TEST(ExplanationJson, NamesWhatIsWrong) {
  EXPECT_THAT(problem_of("{"), HasSubstr("e.json"));
  EXPECT_THAT(problem_of(R"({"effects": [], "where": [], "gap": {}})"), HasSubstr("key verdict: is missing"));
  EXPECT_THAT(problem_of(R"({"verdict": "perhaps", "effects": [], "where": [], "gap": {}})"),
              HasSubstr("key verdict: \"perhaps\" is no verdict"));
  EXPECT_THAT(problem_of(R"({"verdict": "none", "effects": [], "where": [{"phase": [1]}], "gap": {}})"),
              HasSubstr("key where[0].phase: "));
  EXPECT_THAT(problem_of(R"({"format_version": 99})"), HasSubstr("newer"));
  Explanation torn = test::explained_hose();
  torn.traces[0].after.pop_back();
  EXPECT_THAT(problem_of(to_json(torn)), HasSubstr("differ in length"));
}

}  // namespace
}  // namespace diastole::explain
