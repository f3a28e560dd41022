#include "protocol/contract/table_reader.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string message_of(auto&& action) {
  try {
    action();
  } catch (const InputError& error) {
    return error.what();
  }
  return "(no error)";
}

TableReader reader(std::string_view text) { return TableReader::from_text(text, "gel.toml"); }

TEST(TableReader, ReadsEveryKindOfValue) {
  TableReader root = reader(R"(
    format = "diastole-study"
    version = 1
    height_mm = 85
    mesh = [8, 4, 1]
    names = ["a", "b"]
    fast = true
    [law.parameters.C1_kPa]
    start = 6.0
    [[segment]]
    cycles = 10
    [[segment]]
    cycles = 20
  )");
  EXPECT_EQ(root.expect_format("diastole-study", 1), 1);
  EXPECT_DOUBLE_EQ(root.number("height_mm", {.above = 0}), 85.0);
  EXPECT_THAT(root.integers("mesh", 3), testing::ElementsAre(8, 4, 1));
  EXPECT_THAT(root.texts_or("names", {}), testing::ElementsAre("a", "b"));
  EXPECT_TRUE(root.flag_or("fast", false));
  EXPECT_DOUBLE_EQ(root.number_or("absent", 2.5), 2.5);
  TableReader law = root.table("law");
  auto parameters = law.table("parameters").named_tables();
  ASSERT_EQ(parameters.size(), 1U);
  EXPECT_EQ(parameters[0].first, "C1_kPa");
  EXPECT_DOUBLE_EQ(parameters[0].second.number("start"), 6.0);
  std::vector<TableReader> segments = root.tables("segment");
  ASSERT_EQ(segments.size(), 2U);
  EXPECT_EQ(segments[1].integer("cycles"), 20);
  EXPECT_NO_THROW(root.finish());
}

TEST(TableReader, AMisspeltKeyIsNamedWhereTheRequiredOneIsMissing) {
  TableReader root = reader("perod_s = 1\nstroke_ml = 40\nouter_radius_mm = 50\n");
  EXPECT_THAT(message_of([&] { (void)root.number("stroke_mL"); }),
              AllOf(HasSubstr("key stroke_mL: is missing"),
                    HasSubstr("There is \"stroke_ml\" on line 2: did you mean stroke_mL?")));
  EXPECT_THAT(message_of([&] { (void)root.number("period_s"); }),
              HasSubstr("\"perod_s\" on line 1: did you mean period_s?"));
}

TEST(TableReader, AnotherKnownKeyIsNotTakenForAMisspelling) {
  TableReader root = reader("outer_radius_mm = 50\nC2_kPa = 1\n");
  EXPECT_THAT(message_of([&] { (void)root.number("inner_radius_mm"); }),
              AllOf(HasSubstr("Add inner_radius_mm"), testing::Not(HasSubstr("outer_radius_mm"))));
  (void)root.number("C2_kPa");
  EXPECT_THAT(message_of([&] { (void)root.number("C1_kPa"); }), HasSubstr("Add C1_kPa"));
}

TEST(TableReader, AnUnknownKeyNamesItselfItsLineAndTheNearestKnownKey) {
  TableReader root = reader("stroke_mL = 40\nperiod = 1.2\n");
  (void)root.number("stroke_mL");
  (void)root.number_or("period_s", 1.0);
  EXPECT_THAT(message_of([&] { root.finish(); }), AllOf(HasSubstr("gel.toml"), HasSubstr("line 2"),
                                                        HasSubstr("key period"), HasSubstr("\"period_s\"")));
}

TEST(TableReader, AWrongValueTellsTheValueAndTheAllowedRange) {
  TableReader root = reader("[segment]\ncycles = -3\nperiod_s = nan\nwaveform = \"parabola\"\n");
  TableReader segment = root.table("segment");
  EXPECT_THAT(message_of([&] { (void)segment.integer("cycles", {.at_least = 1}); }),
              AllOf(HasSubstr("segment.cycles"), HasSubstr("-3"), HasSubstr("at least 1")));
  EXPECT_THAT(message_of([&] { (void)segment.number("period_s", {.above = 0}); }), HasSubstr("nan"));
  EXPECT_THAT(message_of([&] {
                (void)segment.choice("waveform", {"sinusoidal", "parabolic"});
              }),
              HasSubstr("Did you mean \"parabolic\"?"));
  EXPECT_THAT(message_of([&] { (void)segment.number("stroke_mL"); }),
              HasSubstr("segment.stroke_mL: is missing"));
}

TEST(TableReader, AWrongTypeIsNotConverted) {
  TableReader root = reader("cycles = 3.5\nname = 7\nmesh = [1, 2]\n");
  EXPECT_THAT(message_of([&] { (void)root.integer("cycles"); }), HasSubstr("not a whole number"));
  EXPECT_THAT(message_of([&] { (void)root.text("name"); }), HasSubstr("not a text"));
  EXPECT_THAT(message_of([&] { (void)root.integers("mesh", 3); }), HasSubstr("2 entries"));
  EXPECT_THAT(message_of([&] { (void)root.table("mesh"); }), HasSubstr("not a table"));
}

TEST(TableReader, AnUnreadableFileIsAnInputError) {
  EXPECT_THAT(message_of([] { (void)TableReader::from_file("no/such.toml"); }), HasSubstr("no/such.toml"));
  EXPECT_THAT(message_of([] { (void)reader("a = \n"); }), AllOf(HasSubstr("line 1"), HasSubstr("not TOML")));
  EXPECT_THAT(message_of([] { (void)TableReader::from_file("/"); }), HasSubstr("cannot be opened"));
}

TEST(TableReader, APlaceCountsCharacters) {
  TableReader root = reader("a = \"½ ½ x\"\nb = \"\"\"½½½½½½\n½x\"\"\"\nc = \"\"\"½½½½½½x\"\"\"");
  const auto place_of_x = [&](const char* key) {
    const PlacedText text = root.placed_text(key);
    return text.place(text.text.find('x'));
  };
  EXPECT_EQ(place_of_x("a"), "line 1, column 10, key a");
  EXPECT_EQ(place_of_x("b"), "line 3, column 2, key b");
  EXPECT_EQ(place_of_x("c"), "line 4, column 14, key c");
}

TEST(TableReader, AMessageHoldsNoControlCharacters) {
  const InputError error({"f.toml", "", "\"a\x01\x1B\x7F½\" is no id", "Write\nanother."});
  EXPECT_STREQ(error.what(), "f.toml: \"a\\x01\\x1B\\x7F½\" is no id\n  Write\nanother.");
}

TEST(TableReader, ARunFileInPlaceOfAStudyIsTold) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "table_reader.run.h5";
  std::ofstream(file, std::ios::binary) << "\x89HDF\r\n\x1a\n";
  EXPECT_THAT(message_of([&] { (void)TableReader::from_file(file); }),
              AllOf(HasSubstr("HDF5"), HasSubstr("NAME.study.toml")));
  EXPECT_THAT(message_of([] { (void)reader("\x89HDF\r\n\x1a\n"); }), HasSubstr("is an HDF5 file"));
  std::filesystem::remove(file);
}

TEST(TableReader, AForeignFormatOrNewerVersionIsRefused) {
  EXPECT_THAT(
      message_of([] { reader("format = \"other\"\nversion = 1").expect_format("diastole-study", 1); }),
      HasSubstr("\"other\""));
  EXPECT_THAT(message_of([] { reader("format = \"f\"\nversion = 9").expect_format("f", 1); }),
              HasSubstr("Update Diastole"));
}

}  // namespace
}  // namespace diastole
