#include <gmock/gmock.h>

#include "estimator/explain/verdict/explanation_json.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/score/score.hpp"

namespace diastole::explain {
namespace {

using test::message_of;
using testing::ElementsAre;
using testing::HasSubstr;

Truth hidden(TruthKind kind, const std::vector<std::string>& ids, double size_sigma = 50.0) {
  Truth truth;
  truth.kind = kind;
  truth.size_sigma = size_sigma;
  truth.size = size_sigma < 8.0 ? EffectSize::small : EffectSize::large;
  for (const std::string& id : ids)
    truth.hidden.push_back({id, "", {{"wave_speed_m_s", 60.0}}});
  return truth;
}

Explanation answer(Verdict verdict, const std::vector<std::string>& ids = {}) {
  Explanation found;
  found.verdict = verdict;
  for (const std::string& id : ids)
    found.effects.push_back({id, {{"wave_speed_m_s", 63.0, 2.0, {59.0, 67.0}}}, {}});
  found.gap.closed = 0.95;
  return found;
}

const ScoreRow& row_of(const Score& score, const std::string& begins) {
  for (const ScoreRow& row : score.rows)
    if (row.figure.starts_with(begins)) return row;
  throw std::out_of_range(begins);
}

TEST(Score, OfAPairWithASmallPartAsksForNoFalseName) {
  Truth pair = hidden(TruthKind::pair, {"sensor-drift", "hose-compliance"});
  pair.size = EffectSize::medium;
  const Score score = score_cases({{pair, answer(Verdict::named, {"hose-compliance"})},
                                   {pair, answer(Verdict::named, {"hose-compliance", "stroke-gain"})}});
  EXPECT_EQ(row_of(score, "pairs, both").cases, 0U);
  EXPECT_EQ(row_of(score, "pairs: any false").hits, 1U);
  const auto part = std::ranges::find(score.confusion, "hose-compliance", &Confusion::answer);
  ASSERT_NE(part, score.confusion.end());
  EXPECT_TRUE(part->right);
}

TEST(Score, CountsEachRow) {
  const Truth nothing = hidden(TruthKind::none, {});
  const Truth hose = hidden(TruthKind::single, {"hose-compliance"});
  const Truth pair = hidden(TruthKind::pair, {"sensor-drift", "hose-compliance"});
  const Truth strange = hidden(TruthKind::outside, {"outside:kinking-hose"});
  Truth open = hidden(TruthKind::inseparable, {"radius-error"}, 3.0);
  open.alternatives = {{"stroke-gain"}};
  Explanation either = answer(Verdict::ambiguous, {"stroke-gain"});
  either.ambiguous_with = {{"radius-error"}};
  either.next_experiment = NextExperiment{"", {}, 7.0, ""};
  const Score score = score_cases({{nothing, answer(Verdict::none)},
                                   {nothing, answer(Verdict::unexplained)},
                                   {hose, answer(Verdict::named, {"hose-compliance"})},
                                   {hose, answer(Verdict::named, {"air-bubble-pump"})},
                                   {pair, answer(Verdict::named, {"hose-compliance", "sensor-drift"})},
                                   {pair, answer(Verdict::named, {"hose-compliance"})},
                                   {strange, answer(Verdict::unexplained)},
                                   {open, either},
                                   {open, answer(Verdict::named, {"stroke-gain"})}});
  EXPECT_EQ(row_of(score, "none:").hits, 0U);
  EXPECT_EQ(row_of(score, "none:").cases, 2U);
  EXPECT_EQ(row_of(score, "single, large").value, 0.5);
  EXPECT_EQ(row_of(score, "pairs, both").hits, 1U);
  EXPECT_EQ(row_of(score, "pairs: any").hits, 0U);
  EXPECT_EQ(row_of(score, "outside the library: unexplained").value, 1.0);
  EXPECT_EQ(row_of(score, "inseparable").value, 1.0);  // what fits as well is no wrong name
  EXPECT_EQ(row_of(score, "any: wrong").hits, 1U);
  EXPECT_EQ(row_of(score, "ambiguous: proposed").value, 1.0);
  EXPECT_NEAR(row_of(score, "parameter error").value, 0.05, 1e-12);
  EXPECT_EQ(row_of(score, "parameter's").value, 1.0);
  EXPECT_TRUE(score.passed());
  EXPECT_THAT(in_words(score), HasSubstr("hose-compliance"));
  EXPECT_THAT(in_words(score), HasSubstr("x   1"));
  EXPECT_THAT(to_json(score), HasSubstr("\"passed\": true"));
}

TEST(Score, FailsOnAFalseAlarmOrAConfidentErrorWhateverTheRestSays) {
  const Truth nothing = hidden(TruthKind::none, {});
  const Truth strange = hidden(TruthKind::outside, {"outside:kinking-hose"});
  EXPECT_FALSE(score_cases({{nothing, answer(Verdict::named, {"sensor-gain"})}}).passed());
  EXPECT_FALSE(score_cases({{strange, answer(Verdict::named, {"sensor-gain"})}}).passed());
  EXPECT_TRUE(score_cases({{strange, answer(Verdict::none)}}).passed());
  EXPECT_EQ(row_of(score_cases({{strange, answer(Verdict::none)}}), "outside the library: unex").hits, 0U);
  EXPECT_TRUE(score_cases({{hidden(TruthKind::single, {"sensor-gain"}), answer(Verdict::none)}}).passed());
}

TEST(Score, AnInseparableEffectMayBeLeftOpenOrUnsaidButNotNamedAsAnother) {
  Truth faint = hidden(TruthKind::inseparable, {"sensor-gain"}, 3.0);
  faint.alternatives = {{"radius-error"}};
  const auto is_right = [&](const Explanation& found) {
    return row_of(score_cases({{faint, found}}), "inseparable").value == 1.0;
  };
  EXPECT_TRUE(is_right(answer(Verdict::none)));
  EXPECT_FALSE(is_right(answer(Verdict::named, {"stroke-gain"})));
  Explanation open = answer(Verdict::ambiguous, {"radius-error"});
  EXPECT_FALSE(is_right(open));
  open.ambiguous_with = {{"sensor-gain"}};
  EXPECT_TRUE(is_right(open));
}

TEST(Score, WithAReferenceWhatOnlyTheRigsErrorHidesIsSeparable) {
  Truth hose = hidden(TruthKind::single, {"hose-compliance"});
  hose.alternatives_without_reference = {{"air-bubble-pump"}};
  Explanation either = answer(Verdict::ambiguous, {"air-bubble-pump"});
  either.ambiguous_with = {{"hose-compliance"}};
  EXPECT_EQ(row_of(score_cases({{hose, either}}), "single, large").cases, 0U);
  EXPECT_EQ(row_of(score_cases({{hose, either}}), "inseparable").hits, 1U);
  either.model_error = ModelErrorSize{"reference", 5.0, 0.1, {}};
  EXPECT_EQ(row_of(score_cases({{hose, either}}), "single, large").cases, 1U);
  EXPECT_EQ(row_of(score_cases({{hose, either}}), "single, large").hits, 0U);
}

TEST(Score, AnImperfectionOfTheRigMayBeNamedAtNoMoreThanThreeTimesItsSize) {
  Truth nothing = hidden(TruthKind::none, {});
  nothing.imperfections = {{"hose-compliance", "", {{"wave_speed_m_s", 30.0}}}};
  EXPECT_TRUE(score_cases({{nothing, answer(Verdict::named, {"hose-compliance"})}}).passed());
  nothing.imperfections[0].parameters["wave_speed_m_s"] = 20.0;  // 63 was named
  EXPECT_FALSE(score_cases({{nothing, answer(Verdict::named, {"hose-compliance"})}}).passed());
}

TEST(Score, GivesIntervalsOfClopperAndPearson) {
  EXPECT_NEAR(clopper_pearson(0, 8)[1], 0.312, 5e-4);
  EXPECT_EQ(clopper_pearson(0, 8)[0], 0.0);
  EXPECT_NEAR(clopper_pearson(5, 10)[0], 0.1871, 5e-5);
  EXPECT_NEAR(clopper_pearson(5, 10)[1], 0.8129, 5e-5);
  EXPECT_NEAR(clopper_pearson(8, 8)[0], 0.688, 5e-4);
}

TEST(Score, CountsHowOftenAVerdictWasRightByItsConfidence) {
  const Truth hose = hidden(TruthKind::single, {"hose-compliance"});
  Explanation right = answer(Verdict::named, {"hose-compliance"}),
              wrong = answer(Verdict::named, {"backlash"});
  right.confidence = 0.96;
  wrong.confidence = 0.98;
  const Score score = score_cases({{hose, right}, {hose, wrong}, {hose, answer(Verdict::none)}});
  ASSERT_EQ(score.reliability.size(), 1U);
  EXPECT_NEAR(score.reliability[0].mean, 0.97, 1e-12);
  EXPECT_EQ(score.reliability[0].right, 1U);
  EXPECT_EQ(score.reliability[0].cases, 2U);
}

TEST(Score, ThePortIsThatOfTheFirstMisfit) {
  Explanation found = answer(Verdict::named, {"hose-compliance"});
  found.where.push_back({"drive", "", "pump_kPa", {}, {}, {}, "", 10.0, 0.0});
  const Truth hose = hidden(TruthKind::single, {"hose-compliance"});
  EXPECT_EQ(row_of(score_cases({{hose, found}}), "port").hits, 1U);
  found.where[0].port = "sensor";
  EXPECT_EQ(row_of(score_cases({{hose, found}}), "port").hits, 0U);
}

TEST(TruthFile, ReadsLabelsOfRigsAndFieldsAndSealedFiles) {
  const test::ScratchFolder folder;
  const auto rig = folder.write(
      "rig.json", R"({"case-001": {"kind": "single", "d": 9.5, "alternatives": [["radius-error"]],
      "truth": [{"id": "end-bond-slip", "parameters": {"bond_stiffness_kPa_mm": 0.5, "events": [1, 2]}}]}})");
  const auto truths = read_truths(rig);
  ASSERT_EQ(truths.size(), 1U);
  EXPECT_EQ(truths[0].kind, TruthKind::single);
  EXPECT_EQ(truths[0].size_sigma, 9.5);
  EXPECT_EQ(truths[0].hidden[0].parameters.at("bond_compliance_mm_per_kPa"), 2.0);
  EXPECT_THAT(truths[0].alternatives, ElementsAre(ElementsAre("radius-error")));

  const auto field = read_truths(folder.write("field.json", R"({"format": "fegen-labels", "cases": {
      "field-004": {"effect": {"id": "chamber-back-pressure", "k": 1}, "expected": {
        "C1_free": {"excess_chi2": 0.2, "acceptable_verdicts": ["none"]},
        "C1_known_shear": {"excess_chi2": 111, "acceptable_verdicts": ["ambiguous"]},
        "ambiguous_sets": [["tag-bias"], ["chamber-back-pressure"]]}}}})"));
  ASSERT_EQ(field.size(), 2U);
  EXPECT_EQ(field[0].kind, TruthKind::none);
  EXPECT_EQ(field[1].name, "field-004-shear");
  EXPECT_EQ(field[1].kind, TruthKind::inseparable);
  EXPECT_EQ(field[1].alternatives.size(), 2U);

  std::filesystem::create_directory(folder.path() / "sealed");
  folder.write("sealed/mine.sealed.json", R"({"format": "diastole-sealed", "format_version": 1, "seed": 7,
      "kind": "outside", "truth": [{"id": "outside:mains-hum", "port": "sensor", "parameters": {}}]})");
  const auto sealed = read_truths(folder.path() / "sealed");
  EXPECT_EQ(sealed[0].name, "mine");
  EXPECT_EQ(sealed[0].hidden[0].port, "sensor");
  EXPECT_THAT(message_of([&] { read_truths(folder.path()); }), HasSubstr("labels.json"));
  EXPECT_THAT(
      message_of([&] { read_truths(folder.write("a.json", R"({"x": {"kind": "odd", "truth": []}})")); }),
      HasSubstr("\"odd\" is no kind of truth"));
}

TEST(TruthFile, ReadsSizesImperfectionsAndAlternativesOfRigsWithImperfections) {
  const test::ScratchFolder folder;
  const auto truths =
      read_truths(folder.write("labels.json", R"({"rigs": {}, "cases": {"r1-01": {"kind": "single", "d": 90,
      "size": "medium", "alternatives": [], "alternatives_without_reference": [["stroke-gain"]],
      "truth": [{"id": "backlash", "parameters": {"backlash_mL": 0.2}}],
      "also_present": [{"id": "trigger-delay", "namable": true, "parameters": {"delay_s": 0.002}},
                       {"id": "radius-error", "namable": false, "parameters": {"fraction": 0.002}}]}}})"));
  ASSERT_EQ(truths.size(), 1U);
  EXPECT_EQ(truths[0].size, EffectSize::medium);
  EXPECT_THAT(truths[0].alternatives_without_reference, ElementsAre(ElementsAre("stroke-gain")));
  ASSERT_EQ(truths[0].imperfections.size(), 1U);
  EXPECT_EQ(truths[0].imperfections[0].parameters.at("delay_s"), 0.002);
}

TEST(Score, PairsTruthsWithResultsByName) {
  const test::ScratchFolder folder;
  folder.write("labels.json", R"({"a": {"kind": "none", "truth": []}, "b": {"kind": "none", "truth": []},
                                  "c": {"kind": "none", "truth": []}})");
  std::filesystem::create_directory(folder.path() / "a");
  folder.write("a/explanation.json", to_json(answer(Verdict::none)));
  folder.write("b.json", to_json(answer(Verdict::ambiguous)));
  const Score score = score_folder(folder.path(), folder.path());
  EXPECT_EQ(row_of(score, "none:").cases, 2U);
  EXPECT_THAT(score.missing, ElementsAre("c"));
  EXPECT_THAT(in_words(score), HasSubstr("Without an explanation: c"));
  const test::ScratchFolder empty;
  EXPECT_THAT(message_of([&] { score_folder(folder.path(), empty.path()); }),
              HasSubstr("holds no explanation"));
}

TEST(TruthFile, ReadsTheLabelsOfTheIndependentData) {
  const auto data = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "tests/data";
  EXPECT_EQ(read_truths(data / "rig").size(), 54U);
  EXPECT_GE(read_truths(data / "fe").size(), 22U);
}

}  // namespace
}  // namespace diastole::explain
