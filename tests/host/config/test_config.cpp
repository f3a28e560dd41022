#include <fmt/format.h>
#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "host/config/experiment.hpp"
#include "host/config/rig_config.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string example(const std::string& name) {
  std::ifstream stream(std::string(DIASTOLE_SOURCE_DIR) + "/examples/" + name);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

std::string changed(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

RigConfig rig_from(const std::string& text) { return read_rig(TableReader::from_text(text, "rig.toml")); }

TEST(RigConfig, TheExampleGivesThePapersPump) {
  const RigConfig rig = rig_from(example("rig.toml"));
  EXPECT_NEAR(rig.microstep_mL, 7.7916e-3, 1e-6);
  EXPECT_NEAR(rig.hose_inertance_kg_m4, 4.44e7, 1e5);
  // 1 L/s: 8.84 m/s, Re 1.07e5 at 1005 kg/m3; f 0.0175 over 417 bores, K 1.5.
  EXPECT_NEAR(rig.hose_losses.turbulent_Pa, 0.3164 / std::pow(1.066e5, 0.25) * 416.7 * 39.29e3, 3e3);
  EXPECT_NEAR(rig.hose_losses.minor_Pa, 1.5 * 39.29e3, 300);
  EXPECT_EQ(rig.controller.limits.cavity_kPa, 6);
  EXPECT_EQ(rig.daq.channels.at(0).name, "cavity");
  EXPECT_EQ(std::get<int64_t>(rig.attributes.at("microsteps")), 8);
}

TEST(RigConfig, MistakesAreNamedWithTheirPlace) {
  const std::string good = example("rig.toml");
  const auto refusal = [](const std::string& text) {
    return message_of<InputError>([&] { rig_from(text); });
  };
  EXPECT_THAT(refusal(changed(good, "hose_bore_mm", "hose_bor_mm")), HasSubstr("rig.hose_bore_mm"));
  EXPECT_THAT(refusal(changed(good, "catheter_zeta", "catheter_zita")), HasSubstr("\"catheter_zeta\""));
  EXPECT_THAT(refusal(changed(good, "\"modbus-tcp\"", "\"modbus-tpc\"")), HasSubstr("\"modbus-tcp\""));
  EXPECT_THAT(refusal(changed(good, "\"cavity\"", "\"cavty\"")), HasSubstr("cavity"));
  EXPECT_THAT(refusal(changed(good, "port = 502", "port = 70000")),
              AllOf(HasSubstr("line"), HasSubstr("70000")));
  EXPECT_THAT(refusal(changed(good, "kPa_per_V = 4.0", "kPa_per_V = 0.0")),
              AllOf(HasSubstr("kPa_per_V"), HasSubstr("is 0")));
}

TEST(RigConfig, GeometryThatTheControllerCannotCountWithIsRefused) {
  const std::string good = example("rig.toml");
  const auto refusal = [](const std::string& text) {
    return message_of<InputError>([&] { rig_from(text); });
  };
  EXPECT_THAT(refusal(changed(good, "hose_bore_mm = 12.0", "hose_bore_mm = 1.2")),
              AllOf(HasSubstr("line"), HasSubstr("rig.hose_bore_mm"), HasSubstr("inertance")));
  EXPECT_THAT(refusal(changed(good, "bore_mm = 100.0", "bore_mm = 0.001")), HasSubstr("rig.bore_mm"));
  EXPECT_THAT(refusal(changed(good, "bore_mm = 100.0", "bore_mm = 2.0")),
              AllOf(HasSubstr("rig.bore_mm"), HasSubstr("travel_mL")));
  const std::string narrow = changed(good, "bore_mm = 100.0", "bore_mm = 1.0");
  EXPECT_THAT(refusal(narrow), AllOf(HasSubstr("rig.bore_mm"), HasSubstr("pL")));
}

class ChannelName : public testing::TestWithParam<const char*> {};

TEST_P(ChannelName, ThatCannotNameADatasetOfItsOwnIsRefusedWithItsLine) {
  const std::string good = example("rig.toml");
  const std::string second = fmt::format(
      "[[daq.channel]]\nname = \"{}\"\ninput = 1\nkPa_per_V = 4.0\n\n[[daq.channel]]\n", GetParam());
  const std::string text = changed(good, "[[daq.channel]]\n", second);
  EXPECT_THAT(message_of<InputError>([&] { rig_from(text); }),
              AllOf(HasSubstr("rig.toml"), HasSubstr("line"), HasSubstr("name"),
                    HasSubstr(fmt::format("\"{}\"", GetParam()))));
}

INSTANTIATE_TEST_SUITE_P(RigConfig, ChannelName,
                         testing::Values("", "a/b", "cavity_filtered", "Pump", "1st", "_pump", "pump end",
                                         "pump.end", "caf\u00e9", "cavity"));

TEST(RigConfig, ChannelNamesOfSmallLettersDigitsAndUnderscoresAreTaken) {
  const std::string text = changed(example("rig.toml"), "[[daq.channel]]\n",
                                   "[[daq.channel]]\nname = \"pump_end2\"\ninput = 1\nkPa_per_V = 4.0\n\n"
                                   "[[daq.channel]]\n");
  EXPECT_EQ(rig_from(text).daq.channels.at(0).name, "pump_end2");
}

TEST(Experiment, TheExampleIsThePapersSession) {
  const Experiment gel = parse_experiment(example("gel.experiment.toml"), "gel.experiment.toml");
  ASSERT_EQ(gel.segments.size(), 1U);
  EXPECT_EQ(gel.segments[0].waveform, wire::Waveform::parabolic);
  EXPECT_DOUBLE_EQ(gel.segments[0].stroke_mL, 40);
  EXPECT_EQ(gel.cycles(), 10);
  EXPECT_DOUBLE_EQ(gel.least_duration_s(), 13);
}

TEST(Experiment, WaveformsAreSpelledWithDashes) {
  const std::string text = changed(example("gel.experiment.toml"), "\"parabolic\"", "\"reversed-sawtooth\"");
  EXPECT_EQ(parse_experiment(text, "x").segments[0].waveform, wire::Waveform::reversed_sawtooth);
}

TEST(Experiment, AStrokeThatWasMeantInLitresIsDoubted) {
  const std::string good = example("gel.experiment.toml");
  const auto doubts = [](const std::string& text) { return doubts_about(parse_experiment(text, "x")); };
  EXPECT_TRUE(doubts(good).empty());
  const auto found = doubts(changed(good, "stroke_mL = 40.0", "stroke_mL = 0.04"));
  ASSERT_EQ(found.size(), 1U);
  EXPECT_THAT(found[0], AllOf(HasSubstr("segment[0].stroke_mL"), HasSubstr("0.04 mL; 40?")));
  EXPECT_TRUE(doubts(changed(good, "stroke_mL = 40.0", "stroke_mL = 1.0")).empty());
}

TEST(Experiment, MistakesAreNamedWithTheirPlace) {
  const std::string good = example("gel.experiment.toml");
  const auto refusal = [](const std::string& text) {
    return message_of<InputError>([&] { parse_experiment(text, "gel.experiment.toml"); });
  };
  EXPECT_THAT(refusal(changed(good, "period_s = 1.2", "period_s = nan")),
              AllOf(HasSubstr("segment[0].period_s"), HasSubstr("nan")));
  EXPECT_THAT(refusal(changed(good, "cycles = 10", "cycles = 0")), HasSubstr("segment[0].cycles"));
  EXPECT_THAT(refusal(changed(good, "stroke_mL", "stroke_ml")), HasSubstr("stroke_mL"));
  EXPECT_THAT(refusal("format = \"diastole-experiment\"\nversion = 1\n"), HasSubstr("segment"));
}

}  // namespace
}  // namespace diastole
