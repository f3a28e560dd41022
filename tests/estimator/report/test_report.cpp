#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <limits>

#include "estimator/io/fit_file.hpp"
#include "estimator/report/report.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

std::filesystem::path example(const char* name) {
  return std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples" / name;
}

FitRecord gel_fit() {
  FitRecord fit{};
  fit.study = "folder/gel <1>.study.toml";
  fit.law = "neo-hookean";
  fit.specimen = "annulus";
  fit.mesh = {8, 4, 1};
  fit.unknowns = 1792;
  fit.data = "tags";
  fit.parameters = {{"C1_kPa", 8.5692, 0.0877, {8.3989, 8.7428}, 6.0, {1.0, 15.0}, "", {}}};
  fit.parameters[0].smoothness = FittedSmoothness{0.1, true, false, {0.08, 0.15}, 13.4};
  fit.parameters[0].profile = FittedProfile{{8.4, 15.0}, {false, true}};
  fit.parameters[0].posterior = FittedPosterior{8.57, 0.09, {8.4, 8.75}, 1.01, 180};
  fit.posterior = PosteriorDrawing{200, 0.97, 1300, 12.5};
  fit.directions = {{0.05, {{"b1", 0.8}, {"b2", -0.6}}}, {0.01, {{"b1", 0.6}, {"b2", 0.8}}}};
  fit.robust = FittedRobust{4, 0.8, 700};
  fit.pressure_offset_kPa = FittedOffset{0.02, 0.01};
  fit.correlation = {{"C1_kPa", "pressure_kPa[1]"}, {{1.0, 0.32}, {0.32, 1.0}}};
  fit.rms_mm = 0.79436;
  fit.chi2 = 12816.3;
  fit.dof = 12999;
  fit.chi2_per_dof = 0.98595;
  fit.converged = true;
  fit.reason = "Converged: the cost no longer changes.";
  fit.iterations = 3;
  fit.forward_solves = 30;
  fit.seconds = 3.1;
  fit.history = {{0, 7589.1, true, {6.0}}, {1, 6408.2, true, {8.5692}}};
  fit.residuals_used = 13000;
  fit.excluded = {{"farther than 5 mm from the body", 2}};
  fit.undeformed.chi2_per_residual = std::numeric_limits<double>::quiet_NaN();
  fit.undeformed.mean_mm = std::numeric_limits<double>::quiet_NaN();
  fit.frames = {{1, 0.2613, 0.5969, 0.02, 0.6002, 0.0186, 2600, 0.805, 1.012}};
  fit.residuals = {{-5, 0, 5}, {6400, 6600}};
  fit.section_frame = 5;
  fit.sections = {{"Across the axis",
                   "x (mm)",
                   "y (mm)",
                   {{{0, 1}, {1, 0}}},
                   {{{0, 2}, {2, 0}}},
                   {},
                   {},
                   {{1.5}, {0.5}}}};
  fit.remarks = {"Frame 0 confirms the noise."};
  return fit;
}

TEST(FitFile, ComesBackAsItWasWritten) {
  const FitRecord fit = gel_fit();
  const FitRecord back = fit_record_from_json(to_json(fit), "fit.json");
  EXPECT_EQ(to_json(back), to_json(fit));
  EXPECT_EQ(back.parameters[0].name, "C1_kPa");
  EXPECT_EQ(back.parameters[0].value, 8.5692);
  EXPECT_EQ(back.correlation.matrix[0][1], 0.32);
  EXPECT_EQ(back.parameters[0].smoothness->step90[1], 0.15);
  EXPECT_TRUE(back.parameters[0].profile->at_bound[1]);
  EXPECT_EQ(back.parameters[0].posterior->effective_draws, 180);
  EXPECT_EQ(back.directions[0].change[1].second, -0.6);
  EXPECT_EQ(back.robust->wild, 700U);
  EXPECT_EQ(back.pressure_offset_kPa->value, 0.02);
  EXPECT_TRUE(std::isnan(back.undeformed.mean_mm));
}

TEST(FitFile, JunkIsRefusedWithItsReason) {
  const auto fault = [](std::string text) {
    return message_of([&] { (void)fit_record_from_json(text, "fit.json"); });
  };
  EXPECT_THAT(fault("{"), AllOf(HasSubstr("fit.json"), HasSubstr("not a fit result")));
  EXPECT_THAT(fault("{}"), HasSubstr("key format"));
  EXPECT_THAT(fault("[]"), HasSubstr("key format"));
  EXPECT_THAT(fault(R"({"format": 7})"), HasSubstr("fit.json"));
  EXPECT_THAT(fault(R"({"format": "diastole-fit", "format_version": 2})"), HasSubstr("newer"));
  constexpr size_t deep = 150'000;
  EXPECT_THAT(fault(R"({"format": "diastole-fit", "warnings": )" + std::string(deep, '[')),
              HasSubstr("nested more than 64 levels deep"));
  std::string cut = to_json(gel_fit());
  cut.replace(cut.find("\"rms_mm\""), 8, "\"rms\"");
  EXPECT_THAT(fault(cut), HasSubstr("rms_mm"));
}

class ReportPage : public testing::Test {
 protected:
  std::string page(const std::vector<std::filesystem::path>& files) { return report::make_report(files); }
  std::filesystem::path fit_file() { return folder_.write("anything.txt", to_json(gel_fit())); }
  test::ScratchFolder folder_;
};

size_t count(const std::string& text, std::string_view what) {
  size_t found = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1))
    ++found;
  return found;
}

/// Pages are long: a failure names what is missing and spares the rest.
void expect_shown(const std::string& html, std::string_view what) {
  EXPECT_GE(count(html, what), 1U) << what;
}

void expect_self_contained(const std::string& html) {
  EXPECT_TRUE(html.starts_with("<!DOCTYPE html>"));
  EXPECT_TRUE(html.ends_with("</html>\n"));
  for (const char* outside : {"http:", "https:", "src=", "href=", "@import", "url("}) {
    EXPECT_EQ(count(html, outside), 0U) << outside;
  }
  for (const char* tag : {"section", "figure", "table", "svg", "main", "header", "tr"}) {
    const std::string open = std::string("<") + tag;
    EXPECT_EQ(count(html, open + ">") + count(html, open + " "), count(html, std::string("</") + tag + ">"))
        << tag;
  }
}

TEST_F(ReportPage, AFitShowsItsNumbersAndDrawings) {
  const std::string html = page({fit_file()});
  expect_self_contained(html);
  for (const char* shown :
       {"8.569 \u00b1 0.088 kPa", "95 % interval 8.399 to 8.743 kPa", "0.794 mm RMS", "0.5969",
        "0.600 \u00b1 0.019", "Converged: the cost no longer changes.", "Frame 0 confirms the noise.",
        "2 points are not used", "gel &lt;1&gt;.study.toml", "+0.32"}) {
    expect_shown(html, shown);
  }
  EXPECT_GE(count(html, "<svg"), 3U);
  EXPECT_EQ(count(html, "<script"), 0U);  // SVG alone needs none
}

TEST_F(ReportPage, ARegionalFitIsShownOnTheUnrolledWall) {
  FitRecord fit = gel_fit();
  fit.mesh = {4, 2, 1};
  for (size_t i = 0; i < 8; ++i)
    fit.parameters[0].elements.push_back({8.0 + 0.1 * static_cast<double>(i), 0.2, {}});
  fit.parameters[0].elements[5].se = std::numeric_limits<double>::quiet_NaN();
  const std::string html = page({folder_.write("map.json", to_json(fit))});
  expect_self_contained(html);
  for (const char* shown : {"on the wall unrolled", "270°", ">8.50</text>", ">2.50</text>", "var(--rule)"})
    expect_shown(html, shown);
  fit.mesh.clear();  // a mesh file: no wall to unroll
  expect_shown(page({folder_.write("mesh.json", to_json(fit))}), "value and 95 % interval of each element");
}

TEST_F(ReportPage, AFitShowsItsProfilesAndWhatIsWrongWithItsData) {
  FitRecord fit = gel_fit();
  fit.parameters[0].profile =
      FittedProfile{{8.4, 8.75}, {false, false}, {8.4, 8.48, 8.5692, 8.66, 8.75}, {1.92, 0.5, 0, 0.5, 1.92}};
  fit.findings = {{Severity::warning, "wild-points", "5 % are wild.", "frame <2>", 5, "%", "Look at them."}};
  const std::string html = page({folder_.write("profile.json", to_json(fit))});
  expect_self_contained(html);
  for (const char* shown : {"rise of −log likelihood", "what the standard error says",
                            "5 % are wild. Look at them.", "frame &lt;2&gt;"})
    expect_shown(html, shown);
  const FitRecord back = fit_record_from_json(to_json(fit), "fit.json");
  EXPECT_EQ(back.parameters[0].profile->cost_rise[1], 0.5);
  EXPECT_EQ(back.findings[0].id, "wild-points");
}

TEST_F(ReportPage, AMonteCarloTableStandsBesideThePapers) {
  std::string cells =
      "# diastole-cells 1 heart<1>.study.toml seed=1 exact_pressures=1 C_kPa=3 b1=11 b2=2 b3=10\n"
      "noise_mm,frames,repeat,converged,iterations,seconds,C_kPa,C_kPa_se,b1,b1_se,b2,b2_se,b3,b3_se\n";
  for (const char* noise : {"0.4", "0.8"}) {
    for (const char* repeat : {"1", "2"})
      cells += fmt::format("{},1,{},1,4,1.0,3.{},0.2,11,0.5,2,0.1,10,1\n", noise, repeat, repeat);
  }
  const std::string html = page({folder_.write("heart.cells.csv", cells)});
  expect_self_contained(html);
  for (const char* shown : {"heart&lt;1&gt;.study.toml", "10 / 7 / 7 / 13", "2.2 / 0.0 / 0.0 / 0.0",
                            "exactly known", "Dots are the paper's", "C_kPa = 3"})
    expect_shown(html, shown);
  EXPECT_THAT(message_of([&] { (void)page({folder_.write("cut.csv", cells.substr(0, 100))}); }),
              AllOf(HasSubstr("cut.csv"), HasSubstr("no file of Monte Carlo cells")));
}

TEST_F(ReportPage, ARunShowsItsTracesFramesAndSoundness) {
  const std::string html = page({example("recorded-baseline.run.h5")});
  expect_self_contained(html);
  for (const char* shown :
       {"30 triggers", "none missing", "of 12000", "parabolic", "0.525 to 0.600", "4.78"}) {
    expect_shown(html, shown);
  }
  expect_shown(html, "uPlot");
  expect_shown(html, "Permission is hereby granted");
}

TEST_F(ReportPage, AShearTestStandsBesideTheFit) {
  const std::string html = page({example("shear-test.csv"), fit_file()});
  expect_self_contained(html);
  for (const char* shown :
       {"C1, rotational shear", "8.730 ± 0.042 kPa", "force_per_string_N", "C1 by itself"})
    expect_shown(html, shown);
  EXPECT_LT(html.find("<h2>The stiffness"), html.find("<h2>The rotational shear test"));
}

TEST_F(ReportPage, SeveralFilesShareOnePage) {
  const std::string html =
      page({example("recorded-baseline.run.h5"), fit_file(), example("recorded-preload.run.h5")});
  expect_self_contained(html);
  EXPECT_EQ(count(html, "<h2>The session"), 2U);
  EXPECT_LT(html.find("<h2>The stiffness"), html.find("<h2>The session"));
}

TEST_F(ReportPage, FilesOfNoKnownKindAreRefused) {
  const auto fault = [&](const std::filesystem::path& file) {
    return message_of([&] { (void)page({file}); });
  };
  EXPECT_THAT(fault(folder_.write("notes.json", "dear diary")),
              AllOf(HasSubstr("notes.json"), HasSubstr("neither a run")));
  EXPECT_THAT(fault(folder_.write("empty.h5", "")), HasSubstr("neither a run"));
  EXPECT_THAT(fault(folder_.write("other.json", "{\"a\": 1}")), HasSubstr("diastole-fit"));
  EXPECT_THAT(fault(folder_.write("cut.h5", std::string("\x89HDF\r\n\x1a\n", 8) + "rest")),
              HasSubstr("cut.h5"));
  EXPECT_THAT(fault(folder_.path() / "none.json"), HasSubstr("cannot be opened"));
}

}  // namespace
}  // namespace diastole
