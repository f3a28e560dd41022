// The desk of cines: guide points that a person sets and moves, in the file at once, and the ventricle that is fitted to them.

#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "estimator/imaging/geometry/guide_points.hpp"
#include "tests/flow/desk_program.hpp"
#include "tests/tools/sim_scanner/scanned_ventricle.hpp"

namespace diastole::flow {
namespace {

using imaging::GuidePoints;
using imaging::GuideSurface;
using nlohmann::json;
using testing::HasSubstr;

constexpr int players = 7;  // one a slice

class GuideDesk : public DeskProgram {
 protected:
  GuideDesk() { scanner::ScannedVentricle().scan_phases(3, place / "cines"); }
  std::string text(const std::string& name) const {
    std::ostringstream all;
    all << std::ifstream(place / name).rdbuf();
    return all.str();
  }
  GuidePoints guide() const { return imaging::read_guide_points(place / "cines.guide.csv"); }
  WebAnswer post_choice(const json& choice) const { return post("/points", choice.dump(), token); }
  json state() const { return json::parse(get("/state").body); }
};

TEST_F(GuideDesk, WhatIsNotThereIsFoundAndEveryChangeIsInTheFile) {
  begin("cines");
  const std::string found = text("cines.guide.csv");
  const Ended lv =
      run(place, {"diastole", "lv", "cines", "-o", "a.mesh", "--guide", "a.guide.csv", "--json"});
  ASSERT_EQ(lv.exit_code, 0) << lv.err;
  EXPECT_TRUE(found == text("a.guide.csv")) << "what `lv` finds";
  EXPECT_EQ(WebClient(port).get("/points").status, 401);
  const json points = json::parse(get("/points").body)["points"];
  const GuidePoints before = guide();
  ASSERT_EQ(points.size(), before.points.size());

  // A point goes where it is put, in its image's plane: pixels are one millimetre.
  const json& first = points[0];
  ASSERT_EQ(
      post_choice({{"action", "move"}, {"point", first[0]}, {"to", {first[4].get<double>() + 3, first[5]}}})
          .status,
      200);
  const GuidePoints moved = guide();
  EXPECT_NEAR((moved.points[0].place_mm - before.points[0].place_mm).norm(), 3, 0.002);
  EXPECT_EQ(moved.points[0].surface, before.points[0].surface);
  for (size_t i = 1; i < moved.points.size(); ++i)
    EXPECT_EQ(moved.points[i].place_mm, before.points[i].place_mm);

  const WebAnswer set = post_choice(
      {{"action", "set"}, {"slice", 1}, {"phase", 2}, {"surface", "epi"}, {"at", {{20, 30}, {21, 30}}}});
  EXPECT_EQ(json::parse(set.body)["points"], before.points.size() + 2);
  const GuidePoints more = guide();
  EXPECT_EQ(more.points.back().surface, GuideSurface::epi);
  EXPECT_EQ(more.slices[more.points.back().slice], "sa01");
  EXPECT_EQ(more.phases[more.points.back().phase], 2);
  EXPECT_NEAR((more.points.back().place_mm - more.points[more.points.size() - 2].place_mm).norm(), 1, 0.002);

  EXPECT_EQ(post_choice({{"action", "remove"}, {"points", {first[0], points[1][0]}}}).status, 200);
  EXPECT_EQ(guide().points.size(), before.points.size());
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(post_choice({{"action", "undo"}}).status, 200);
  EXPECT_TRUE(text("cines.guide.csv") == found) << "all is taken back";
  EXPECT_EQ(post_choice({{"action", "undo"}}).status, 422) << "nothing is left";
}

TEST_F(GuideDesk, WhatDoesNotFitChangesNothing) {
  begin("cines");
  const std::string found = text("cines.guide.csv");
  for (const std::string bad :
       {"{", "[]", "{}", R"({"action": "turn"})", R"({"action": "move", "point": 999999, "to": [1, 1]})",
        R"({"action": "move", "point": 0, "to": [1]})", R"({"action": "move", "point": 0, "to": [100, 1]})",
        R"({"action": "move", "point": -1, "to": [1, 1]})",
        R"({"action": "move", "point": 0, "to": [null, 1]})",
        R"({"action": "set", "slice": 7, "phase": 0, "surface": "endo", "at": [[1, 1]]})",
        R"({"action": "set", "slice": 0, "phase": 3, "surface": "endo", "at": [[1, 1]]})",
        R"({"action": "set", "slice": 0, "phase": 0, "surface": "aorta", "at": [[1, 1]]})",
        R"({"action": "set", "slice": 0, "phase": 0, "surface": "endo", "at": []})",
        R"({"action": "remove", "points": []})", R"({"action": "remove", "points": [0.9]})",
        R"({"action": "remove", "points": 3})"}) {
    const WebAnswer refused = post("/points", bad, token);
    EXPECT_EQ(refused.status, 422) << bad;
    EXPECT_THAT(refused.body, HasSubstr("cines.guide.csv")) << bad;
  }
  EXPECT_TRUE(text("cines.guide.csv") == found);
  // What another program writes meanwhile is not lost.
  std::ofstream(place / "cines.guide.csv", std::ios::app) << "0,sa01,endo,1,2,3,0.5\n";
  const std::string theirs = text("cines.guide.csv");
  const WebAnswer refused = post_choice({{"action", "remove"}, {"points", {0}}});
  EXPECT_EQ(refused.status, 422);
  EXPECT_THAT(refused.body, HasSubstr("another program has changed it"));
  EXPECT_TRUE(text("cines.guide.csv") == theirs);
  EXPECT_EQ(state()["undoable"], 0);
  // Moved away, it is nobody's loss: the desk's points are written anew.
  std::filesystem::rename(place / "cines.guide.csv", place / "theirs.guide.csv");
  EXPECT_EQ(post_choice({{"action", "remove"}, {"points", {0}}}).status, 200);
  EXPECT_EQ(guide().points.size(), imaging::guide_points_from_text(found, "found").points.size() - 1);
}

TEST_F(GuideDesk, FilesThatAreOfSomethingElseAreRefused) {
  const auto refused = [&](const std::string& file) {
    const Ended ended = run(place, {"diastole", "desk", "cines", "--guide", file, "--no-browser"});
    EXPECT_EQ(ended.exit_code, 2);
    return ended.err;
  };
  place.write("gp.txt", "x y z contour-type sliceID weight frame\n1 2 3 SAX_LV_ENDOCARDIAL 3 1 0\n");
  EXPECT_THAT(refused("gp.txt"), HasSubstr("is no table of guide points"));
  place.write("a.edits.jsonl", R"({"slice": "series 2, slice 1", "phase": 2, "action": "mask"})");
  EXPECT_THAT(refused("a.edits.jsonl"), HasSubstr("is no table of guide points"));
  std::string other = "phase,slice,surface,x_mm,y_mm,z_mm,sigma_mm\n";
  for (int i = 0; i < 9; ++i)
    other += "0,sa01,endo," + std::to_string(i) + ",2,500,0.5\n";
  place.write("other.guide.csv", other);
  EXPECT_THAT(refused("other.guide.csv"), HasSubstr("slice sa01: its points lie"));
  EXPECT_EQ(text("other.guide.csv"), other);
  EXPECT_EQ(run(place, {"diastole", "desk", "cines", "--guide", "a.guide.csv", "-o", "b.tags.csv"}).exit_code,
            2);
  const Ended tags = run(place, {"diastole", "desk", "cines", "-o", "b.tags.csv", "--no-browser"});
  EXPECT_EQ(tags.exit_code, 2) << "tags are asked for, and there are none";
  EXPECT_FALSE(std::filesystem::exists(place / "cines.guide.csv"));
  const Ended again = run(place, {"diastole", "lv", "cines", "-o", "a.mesh", "--guide", "other.guide.csv"});
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("--force")) << "a person may have set those points";
  EXPECT_TRUE(text("other.guide.csv") == other);
}

TEST_F(GuideDesk, PointsInNoneOfTheImagesAreKept) {
  const Ended lv =
      run(place, {"diastole", "lv", "cines", "-o", "a.mesh", "--guide", "all.guide.csv", "--json"});
  ASSERT_EQ(lv.exit_code, 0) << lv.err;
  const std::string more = "9,sa01,endo,1,2,3,0.5\n0,aorta,endo,1,2,3,0.5\n";
  std::ofstream(place / "all.guide.csv", std::ios::app) << more;
  begin("cines", {"--guide", "all.guide.csv"});
  EXPECT_EQ(state()["elsewhere"], 2);
  EXPECT_EQ(post_choice({{"action", "remove"}, {"points", {0}}}).status, 200);
  const std::string kept = text("all.guide.csv");
  EXPECT_THAT(kept, HasSubstr("9,sa01,endo,1.000,2.000,3.000,0.5"));
  EXPECT_THAT(kept, HasSubstr("0,aorta,endo,1.000,2.000,3.000,0.5"));
}

TEST_F(GuideDesk, PointsAreSetInABrowserAndTheWallsFollow) {
  if (Browser::program().empty())
    GTEST_SKIP() << "this machine has no Chromium: apt install chromium-headless-shell";
  begin("cines");
  open_page(1280, 1100, players);
  browser->wait_until("desk.fit && desk.state.fitted_version === desk.state.version");
  const size_t all = guide().points.size();
  // The fitted walls lie where the points were found: of each slice, in the first phase.
  EXPECT_EQ(browser->value("desk.fit.slices.every((s) => s.inner[0].length > 0 && s.outer[0].length > 0)"),
            true);
  const Ended lv = run(place, {"diastole", "lv", "cines.guide.csv", "-o", "a.mesh", "--json"});
  ASSERT_EQ(lv.exit_code, 0) << lv.err;
  EXPECT_NEAR(browser->value("desk.fit.phases[0].cavity_mL").get<double>(),
              lv.json()["cavity_mL"].get<double>(), 1e-6);

  // A point of the second slice is pulled four pixels outwards.
  const std::string points_of_slice =
      "desk.points.filter((p) => p.slice === 1 && p.phase === 0 && p.surface === 'endo')";
  const json start = browser->value(points_of_slice);
  ASSERT_GT(start.size(), 8U);
  const double column = start[0]["at"][0], row = start[0]["at"][1];
  click("[data-tool=move]");
  browser->drag(in_window(1, {{column, row}, {column + 2, row}, {column + 4, row}}));
  browser->wait_until("desk.state.undoable === 1");
  browser->wait_until("Math.abs(" + points_of_slice + "[0].at[0] - " + std::to_string(column + 4) +
                      ") < 0.1");
  EXPECT_EQ(browser->value("document.getElementById('fit').disabled"), false);

  // Points along a drawn arc, one each four millimetres of its nineteen; they and what is beside them are taken away again.
  Path arc;
  for (int degrees = -60; degrees <= -20; degrees += 2)
    arc.push_back({49.5 + 28 * std::cos(degrees * std::numbers::pi / 180),
                   49.5 + 28 * std::sin(degrees * std::numbers::pi / 180)});
  click("[data-tool=epi]");
  browser->drag(in_window(1, arc));
  browser->wait_until("desk.state.undoable === 2");
  const size_t drawn = guide().points.size() - all;
  EXPECT_GE(drawn, 4U);
  EXPECT_LE(drawn, 6U);
  screenshot("guide-desk.png");
  click("[data-tool=remove]");
  browser->drag(in_window(1, {{60, 20}, {85, 20}, {85, 43}, {74, 43}, {60, 28}}));
  browser->wait_until("desk.state.undoable === 3");
  EXPECT_LE(guide().points.size(), all);
  click("#undo");
  browser->wait_until("desk.state.undoable === 2");
  EXPECT_EQ(guide().points.size(), all + drawn);
  click("#undo");
  browser->wait_until("desk.state.undoable === 1");

  const json fitted = browser->value("desk.fit.version");
  browser->wait_until("!document.getElementById('fit').disabled");
  click("#fit");
  browser->wait_until("desk.fit.version !== " + fitted.dump() +
                      " && desk.state.fitted_version === desk.state.version");
  expect_a_good_page();
  EXPECT_EQ(guide().points.size(), all);
}

}  // namespace
}  // namespace diastole::flow
