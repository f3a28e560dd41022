#include <gmock/gmock.h>

#include "estimator/shear/shear_fit.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::string header =
    "inner_radius_mm,outer_radius_mm,height_mm,arm_mm,force_per_string_N,radius_mm,rotation_deg\n";
const std::string good_rows = "8,19,24,20,0.5,10,1\n8,19,24,20,0.5,12,1.5\n8,19,24,20,0.5,15,2\n";

ShearTest read(const std::string& text) { return shear_test_from_text(text, "data.csv"); }

TEST(ShearFile, TheLoadColumnSaysHowTheMomentComes) {
  const ShearRow each = read(header + good_rows).rows[0];
  EXPECT_DOUBLE_EQ(each.moment_Nmm, 20);
  EXPECT_NEAR(each.rotation_rad, 0.0174533, 1e-7);
  EXPECT_EQ(each.line, 2U);
  EXPECT_EQ(each.annulus, (Annulus{8, 19, 24}));

  std::string total = header;
  total.replace(total.find("force_per_string_N"), 18, "force_total_N");
  EXPECT_DOUBLE_EQ(read(total + good_rows).rows[0].moment_Nmm, 10);
  EXPECT_EQ(read(total + good_rows).load, "force_total_N");

  const ShearTest moment = read(
      "inner_radius_mm,outer_radius_mm,height_mm,moment_Nmm,radius_mm,rotation_deg\r\n"
      "8,19,24,20,10,1\r\n8,19,24,20,12,1.5\r\n8,19,24,-20,15,-2\r\n");
  EXPECT_DOUBLE_EQ(moment.rows[2].moment_Nmm, -20);
  EXPECT_DOUBLE_EQ(moment.rows[2].radius_mm, 15);
}

TEST(ShearFile, IsKnownByItsHeader) {
  EXPECT_TRUE(is_shear_test(header));
  EXPECT_TRUE(is_shear_test("\xEF\xBB\xBF" + header));
  EXPECT_FALSE(is_shear_test("frame,time_s\n"));
  EXPECT_FALSE(is_shear_test(""));
}

TEST(ShearFile, TheExampleIsOfThePapersDesignAndRecoversItsTruth) {
  const ShearTest test = read_shear_test(DIASTOLE_SOURCE_DIR "/examples/shear-test.csv");
  EXPECT_EQ(test.rows.size(), 60U);
  const ShearFit fit = fit_shear(test);
  EXPECT_LE(fit.se_kPa, 0.06);
  EXPECT_LE(fit.ci95_kPa[0], 8.71);
  EXPECT_GE(fit.ci95_kPa[1], 8.71);
}

struct BadFile {
  const char* name;
  std::string text;
  std::vector<const char*> said;
};

std::string with_row(const std::string& row) { return header + good_rows + row + "\n"; }

TEST(ShearFile, EveryFaultIsToldWithItsPlaceAndRemedy) {
  const std::vector<BadFile> files = {
      {"empty", "", {"data.csv", "empty", "must hold the header"}},
      {"no load", "inner_radius_mm,outer_radius_mm\n1,2\n", {"line 1", "what the load is", "moment_Nmm"}},
      {"two loads",
       "inner_radius_mm,outer_radius_mm,height_mm,force_per_string_N,force_total_N,radius_mm,rotation_deg\n",
       {"line 1", "\"force_per_string_N\" where \"arm_mm\" belongs", "must read"}},
      {"radians",
       "inner_radius_mm,outer_radius_mm,height_mm,moment_Nmm,radius_mm,rotation_rad\n",
       {"line 1", "\"rotation_rad\" where \"rotation_deg\" belongs"}},
      {"no rows", header, {"line 2", "no row"}},
      {"two rows", header + "8,19,24,20,0.5,10,1\n8,19,24,20,0.5,12,1\n", {"2 rows", "3 rows or more"}},
      {"not a number", with_row("8,19,24,20,0.5,ten,1"), {"line 5, column radius_mm", "\"ten\"", "decimal"}},
      {"comma", with_row("8,19,24,20,0,5,10,1"), {"line 5", "more than the 7 columns"}},
      {"short row", with_row("8,19,24,20,0.5,10"), {"line 5", "6 columns where 7 belong"}},
      {"infinite", with_row("8,19,24,20,0.5,10,inf"), {"line 5, column rotation_deg", "not a finite"}},
      {"inner zero",
       with_row("0,19,24,20,0.5,10,1"),
       {"line 5, column inner_radius_mm", "0 is not a length"}},
      {"outer negative", with_row("8,-19,24,20,0.5,10,1"), {"line 5, column outer_radius_mm", "-19"}},
      {"height zero", with_row("8,19,0,20,0.5,10,1"), {"line 5, column height_mm", "above zero"}},
      {"arm zero", with_row("8,19,24,0,0.5,10,1"), {"line 5, column arm_mm", "above zero"}},
      {"radius negative", with_row("8,19,24,20,0.5,-10,1"), {"line 5, column radius_mm", "above zero"}},
      {"swapped radii",
       with_row("19,8,24,20,0.5,10,1"),
       {"line 5, column inner_radius_mm", "not below", "half"}},
      {"no load put on",
       with_row("8,19,24,20,0,10,0"),
       {"line 5, column force_per_string_N", "load of zero", "Leave the unloaded rows out"}},
      {"marker outside",
       with_row("8,19,24,20,0.5,19.5,1"),
       {"line 5, column radius_mm", "19.5 mm is not in the gel", "not diameters"}},
      {"marker inside", with_row("8,19,24,20,0.5,7,1"), {"line 5, column radius_mm", "from 8 to 19 mm"}},
      {"turned over", with_row("8,19,24,20,0.5,10,181"), {"line 5, column rotation_deg", "half a turn"}},
      {"all at the bond",
       header + "8,19,24,20,1,8,0\n8,19,24,20,2,8,0\n8,19,24,20,3,8,0.1\n",
       {"every marker lies on the fixed inner cylinder", "between"}},
      {"nothing turns",
       header + "8,19,24,20,1,9,0\n8,19,24,20,2,10,0\n8,19,24,20,3,11,0\n",
       {"every rotation is zero"}}};
  for (const BadFile& file : files) {
    const std::string message = test::message_of([&] { (void)read(file.text); });
    for (const char* words : file.said)
      EXPECT_THAT(message, AllOf(HasSubstr("data.csv"), HasSubstr(words))) << file.name;
  }
  EXPECT_THAT(test::message_of([] { (void)read_shear_test("no-such.csv"); }), HasSubstr("no-such.csv"));
}

}  // namespace
}  // namespace diastole
