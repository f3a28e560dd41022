#include "estimator/law_fit/bench_test.hpp"

#include <gmock/gmock.h>

#include "tests/estimator/io/scratch_file.hpp"
#include "tests/estimator/shear/synthetic_shear.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

BenchTest read(const std::string& text) { return bench_test_from_text(text, "data.csv"); }
std::string refused(const std::string& text) {
  return test::message_of([&] { (void)read(text); });
}

TEST(BenchTest, ReadsWhatTheHeaderNames) {
  const BenchTest plain = read("stretch,nominal_kPa\n1.1,2\n1.2,3\n1.3,4\n");
  EXPECT_EQ(plain.kind->name, "uniaxial");
  EXPECT_FALSE(plain.has_fibre);
  EXPECT_THAT(plain.readings[1].controls, ElementsAre(1.2));
  EXPECT_DOUBLE_EQ(plain.channels[0].rms, std::sqrt((4 + 9 + 16) / 3.0));

  const BenchTest torsion = read(
      "\xEF\xBB\xBF"
      "cylinder_radius_mm,cylinder_height_mm,axial_stretch,twist_deg,moment_Nmm,axial_force_N,fibre_deg\r\n"
      "8,20,1,10,2,-1,30\r\n8,20,1,20,4,-2,30\r\n8,20,1,30,6,-3,30\r\n");
  EXPECT_EQ(torsion.channels.size(), 2U);
  EXPECT_TRUE(torsion.has_fibre);
  EXPECT_THAT(torsion.readings[2].measured, ElementsAre(6, -3));
  EXPECT_DOUBLE_EQ(torsion.readings[2].fibre_rad, std::numbers::pi / 6);

  const BenchTest without_force = read(
      "cylinder_radius_mm,cylinder_height_mm,axial_stretch,twist_deg,moment_Nmm\n8,20,1,10,2\n8,20,1,20,4\n8,"
      "20,1,30,6\n");
  EXPECT_EQ(without_force.channels.size(), 1U);
}

TEST(BenchTest, ReadsTheFileOfTheShearCommand) {
  const BenchTest test = read_bench_test(DIASTOLE_SOURCE_DIR "/examples/shear-test.csv");
  EXPECT_EQ(test.kind->name, "rotational-shear");
  EXPECT_EQ(test.readings.size(), 60U);
  EXPECT_THAT(test.readings[0].controls, ElementsAre(8, 19, 24, 2 * 0.25 * 19, testing::_));
}

TEST(BenchTest, RefusesWithPlaceValueAndRemedy) {
  EXPECT_THAT(refused(""), HasSubstr("empty"));
  EXPECT_THAT(refused("\x89HDF\r\n\x1a\n"), AllOf(HasSubstr("data.csv: is an HDF5 file"), HasSubstr("CSV")));
  EXPECT_THAT(
      refused("stretch,nominal_kPa\n1.1,2\n1.2,-1e301\n1.3,4\n"),
      AllOf(HasSubstr("data.csv: line 3, column nominal_kPa: -1e+301"), HasSubstr("Correct the value")));
  EXPECT_THAT(refused("inner_radius_mm,outer_radius_mm,height_mm,moment_Nmm,radius_mm,rotation_deg\n"
                      "8,19,24,1e301,12,3\n8,19,24,2,12,3\n8,19,24,3,12,3\n"),
              HasSubstr("line 2, column moment_Nmm: 1e+301"));
  EXPECT_THAT(refused("strain,stress\n1,2\n"),
              AllOf(HasSubstr("data.csv: line 1"), HasSubstr("\"strain\""),
                    HasSubstr("stretch_1,stretch_2,nominal_1_kPa,nominal_2_kPa")));
  EXPECT_THAT(refused("stretch,stress_kPa\n1.1,2\n"),
              HasSubstr("\"stress_kPa\" where \"nominal_kPa\" belongs"));
  EXPECT_THAT(refused("stretch,nominal_kPa\n1.1,2\n1.2,x\n"), HasSubstr("line 3, column nominal_kPa: \"x\""));
  EXPECT_THAT(
      refused("stretch,nominal_kPa\n1.1,2\n110,3\n1.3,4\n"),
      AllOf(HasSubstr("line 3, column stretch: 110 is no stretch"), HasSubstr("1.1 for ten percent longer")));
  EXPECT_THAT(refused("stretch,nominal_kPa\n0.1,2\n0.2,3\n0.3,4\n"),
              AllOf(HasSubstr("column stretch: the specimen is shorter where it is pulled"),
                    HasSubstr("1 + strain")));
  EXPECT_THAT(refused("stretch,nominal_kPa\n1.1,2\n1.2,3\n"), HasSubstr("2 rows show no curve"));
  EXPECT_THAT(refused("stretch,nominal_kPa\n1.1,0\n1.2,0\n1.3,0\n"),
              HasSubstr("column nominal_kPa: every value is zero"));
  EXPECT_THAT(refused("stretch,nominal_kPa,fibre_deg\n1.1,1,45\n1.2,2,0\n1.3,3,0\n"),
              AllOf(HasSubstr("line 2, column fibre_deg"), HasSubstr("would shear")));
  EXPECT_THAT(refused("shear,shear_stress_kPa,fibre_deg\n0.1,1,500\n0.2,2,0\n0.3,3,0\n"),
              HasSubstr("500 is no direction"));
  const std::string tube =
      "unloaded_inner_radius_mm,unloaded_outer_radius_mm,axial_stretch,outer_radius_mm,pressure_kPa\n";
  EXPECT_THAT(
      refused(tube + "4,6,1,4,1\n4,6,1,7,2\n4,6,1,8,3\n"),
      AllOf(HasSubstr("line 2, column outer_radius_mm"), HasSubstr("leaves no hole"), HasSubstr("4.472 mm")));
  EXPECT_THAT(refused(tube + "6,4,1,7,1\n4,6,1,7,2\n4,6,1,8,3\n"),
              HasSubstr("is not below the outer radius 4 mm"));
  EXPECT_THAT(refused(tube + "4,0,1,7,1\n"), HasSubstr("0 is not a length above zero"));
}

}  // namespace
}  // namespace diastole
