// Coloured sections, and the report of a solution.

#include <gmock/gmock.h>

#include "estimator/io/solution_file.hpp"
#include "estimator/report/colour_scale.hpp"
#include "estimator/report/report.hpp"
#include "estimator/report/section_map.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::report {
namespace {

using testing::HasSubstr;

SolutionSection two_cells() {
  SolutionSection section;
  section.title = "Short axis <1>";
  section.horizontal = "x (mm)";
  section.vertical = "y (mm)";
  section.cells_before = {{0, 0, 10, 0, 10, 10, 0, 10}, {10, 0, 20, 0, 20, 10}};
  section.cells_after = {{0, 0, 12, 0, 12, 12, 0, 12}, {12, 0, 24, 0, 24, 12}};
  section.outline_before = {0, 0, 20, 0, 20, 0, 20, 10};
  section.outline_after = {0, 0, 24, 0, 24, 0, 24, 12};
  section.fields = {{"stress_cc_kPa", {1.0, 5.0}}, {"strain_cc", {0.1, 0.2}}, {"stress_rr_kPa", {-2.0, 0.0}}};
  return section;
}

TEST(MapColour, IsViridisAndBecomesEverLighter) {
  EXPECT_EQ(map_colour(0.0), "#440154");
  EXPECT_EQ(map_colour(1.0), "#fde725");
  EXPECT_EQ(map_colour(7.0), "#fde725");
  double before = -1.0;
  for (int i = 0; i <= 40; ++i) {
    const long rgb = std::stol(map_colour(i / 40.0).substr(1), nullptr, 16);
    const double lightness = 0.2126 * static_cast<double>(rgb >> 16) +
                             0.7152 * static_cast<double>((rgb >> 8) & 255) +
                             0.0722 * static_cast<double>(rgb & 255);
    EXPECT_GT(lightness, before) << i;
    before = lightness;
  }
}

TEST(ColourRange, LeavesSingularCornersOut) {
  std::vector<double> values(100, 1.0);
  values[50] = 3.0;
  for (size_t i = 0; i < 50; ++i)
    values[i] = 2.0;
  values.push_back(1000.0);
  values.push_back(std::numeric_limits<double>::quiet_NaN());
  const auto [low, high] = colour_range(values);
  EXPECT_EQ(low, 1.0);
  EXPECT_EQ(high, 2.0);
  const auto [least, most] = colour_range({4.0, 4.0});
  EXPECT_LT(least, most);
  EXPECT_EQ(colour_range({})[1], 1.0);
}

TEST(SectionMap, DrawsBothStatesOnOneScaleWithOneBar) {
  const SolutionSection section = two_cells();
  const std::string svg = section_map(section, section.fields[0], "σ (kPa)", "at 6 kPa");
  EXPECT_THAT(svg, HasSubstr("undeformed"));
  EXPECT_THAT(svg, HasSubstr("at 6 kPa"));
  EXPECT_THAT(svg, HasSubstr("σ (kPa)"));
  EXPECT_THAT(svg, HasSubstr(">10 mm<"));
  EXPECT_THAT(svg, HasSubstr("→ x, ↑ y"));
  EXPECT_THAT(svg, testing::Not(HasSubstr("nan")));
}

TEST(SolutionReport, ShowsMapsProfilesAndTheTractionOnTheWall) {
  SolutionRecord record;
  record.study = "folder/gel.study.toml";
  record.law = "neo-hookean";
  record.parameters = {{"C1_kPa", 6.5}};
  record.mesh = {8, 4, 1};
  record.pressure_kPa = 6.0;
  record.cavity_volume_mL = 213.5;
  record.sections = {two_cells()};
  SolutionProfile profile{"Through the wall", {0.0, 27.5}, {}};
  for (const char* entry : {"cc", "ll", "rr"}) {
    profile.fields.push_back({std::string("stress_") + entry + "_kPa", {-6.02, 0.01}});
    profile.fields.push_back({std::string("strain_") + entry, {0.4, 0.1}});
  }
  record.profiles = {profile};
  const test::ScratchFolder folder;
  const std::filesystem::path file = folder.write("gel.json", to_json(record));
  const std::string page = make_report(std::vector<std::filesystem::path>{file});
  EXPECT_THAT(page, HasSubstr("Strain and stress under load"));
  EXPECT_THAT(page, HasSubstr("Short axis &lt;1&gt;: Cauchy stress around the cavity."));
  EXPECT_THAT(page, HasSubstr("−6.02 kPa"));
  EXPECT_THAT(page, HasSubstr("C1_kPa 6.5"));
  EXPECT_THAT(page, HasSubstr("circumferential"));
  EXPECT_THAT(page, testing::Not(HasSubstr("along the fibres")));
}

}  // namespace
}  // namespace diastole::report
