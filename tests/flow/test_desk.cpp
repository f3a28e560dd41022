// The desk of tagged images: its endpoint, and its page in a real browser.

#include <gmock/gmock.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "tests/flow/desk_program.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class Desk : public DeskProgram {
 protected:
  Desk() {
    std::filesystem::copy(std::filesystem::path(DIASTOLE_EXAMPLES) / "tagged-gel", place / "gel",
                          std::filesystem::copy_options::recursive);
  }
  /// The lines of the edits file.
  std::vector<json> choices() const {
    std::vector<json> lines;
    std::ifstream file(place / "gel/dicom.edits.jsonl");
    for (std::string line; std::getline(file, line);)
      lines.push_back(json::parse(line));
    return lines;
  }
};

const std::string mask =
    R"({"slice": "series 2, slice 1", "phase": 2, "action": "mask", "points": [[60, 40], [80, 40], [80, 60]]})";

TEST_F(Desk, LetsInOnlyThisMachineWithItsTokenAndWritesNothingElse) {
  begin("gel/dicom");
  EXPECT_EQ(WebClient(port).get("/").status, 200);
  EXPECT_EQ(WebClient(port).get("/state").status, 401);
  EXPECT_EQ(WebClient(port).get("/state", {"Authorization: Bearer " + token}).status, 200);
  EXPECT_EQ(WebClient(port).get("/state", {"Authorization: Bearer " + token}, "evil.example").status, 403);
  EXPECT_EQ(
      WebClient(port).get("/state", {"Authorization: Bearer " + token, "Origin: http://evil.example"}).status,
      403);
  EXPECT_EQ(WebClient(port).get("/../gel/dicom.edits.jsonl").status, 401);
  EXPECT_EQ(post("/edits", mask, "wrong").status, 401);
  EXPECT_EQ(post("/track", "", "wrong").status, 401);
  EXPECT_EQ(post("/edits", std::string(2 << 20, 'x'), token).status, 0) << "longer than any choice";
  for (const std::string bad :
       {"{", "[]", "{\"action\": \"mask\"}",
        R"({"slice": "series 2, slice 1", "phase": 99, "action": "mask", "points": [[1,1],[2,1],[2,2]]})"}) {
    const WebAnswer refused = post("/edits", bad, token);
    EXPECT_EQ(refused.status, 422) << bad;
    EXPECT_THAT(refused.body, HasSubstr("dicom.edits.jsonl")) << bad;
  }
  EXPECT_FALSE(std::filesystem::exists(place / "gel/dicom.edits.jsonl"))
      << "what does not fit is not written";
  const WebAnswer accepted = post("/edits", mask, token);
  EXPECT_EQ(accepted.status, 200);
  EXPECT_EQ(json::parse(accepted.body)["edits"].size(), 1U);
  EXPECT_EQ(choices().size(), 1U);
  // What a person writes meanwhile counts too.
  std::ofstream(place / "gel/dicom.edits.jsonl", std::ios::app) << mask;
  EXPECT_EQ(json::parse(post("/edits", mask, token).body)["edits"].size(), 3U);
  EXPECT_EQ(choices().size(), 3U);
  desk->signal(SIGINT);
  EXPECT_EQ(desk->wait().exit_code, 0);
  EXPECT_EQ(choices().size(), 3U);
}

TEST_F(Desk, RefusesWhatTrackRefuses) {
  place.write("gel/dicom.edits.jsonl", "{\"action\": \"undo\"}\n");
  const Ended undone = run(place, {"diastole", "desk", "gel/dicom", "--no-browser"});
  EXPECT_EQ(undone.exit_code, 2);
  EXPECT_THAT(undone.err, HasSubstr("dicom.edits.jsonl: line 1: nothing is left to undo"));
  const Ended none = run(place, {"diastole", "desk", "gel/none", "--no-browser"});
  EXPECT_EQ(none.exit_code, 2);
  EXPECT_THAT(none.err, HasSubstr("gel/none"));
}

class DeskInABrowser : public Desk {
 protected:
  void SetUp() override {
    if (Browser::program().empty())
      GTEST_SKIP() << "this machine has no Chromium: apt install chromium-headless-shell";
    begin("gel/dicom", {"-o", "gel.tags.csv"});
    open_page(1280, 1100, 4);
  }
  void wait_for_choices(size_t count) {
    browser->wait_until("desk.edits.length === " + std::to_string(count));
  }
};

TEST_F(DeskInABrowser, WhatIsDrawnIsInTheFileAtOnceAndTrackedAgain) {
  EXPECT_EQ(browser->value("location.hash"), "") << "the token is taken out of sight";
  browser->wait_until("desk.state.tracking === false");
  EXPECT_TRUE(std::filesystem::exists(place / "gel.tags.csv"));
  browser->value("(p => { p.range.value = 4; p.draw(); })(desk.players[0])");

  // A line is pulled by a pixel and a half.
  click("[data-tool=line]");
  // The middle of the longest line.
  const json point = browser->value(
      "(i => { const tags = new Map(); for (let n = 0; n < i.points.length; n += 5) { const tag = i.points[n "
      "+ "
      "1]; if (!tags.has(tag)) tags.set(tag, []); tags.get(tag).push([i.points[n + 2], i.points[n + 3]]); } "
      "const [tag, list] = [...tags].sort((a, b) => b[1].length - a[1].length)[0]; return [tag, "
      "...list[Math.floor(list.length / 2)]]; })(desk.players[0].image)");
  const double column = point[1], row = point[2];
  browser->drag(in_window(0, {{column, row}, {column + 0.5, row}, {column + 1.5, row}}));
  wait_for_choices(1);
  ASSERT_EQ(choices().size(), 1U);
  const json line = choices()[0];
  EXPECT_EQ(line["action"], "line");
  EXPECT_EQ(line["slice"], browser->value("desk.players[0].slice.name"));
  EXPECT_EQ(line["phase"], 5);
  EXPECT_EQ(line["direction"], 1);
  EXPECT_EQ(line["tag"], point[0]);
  EXPECT_GE(line["points"].size(), 2U) << "its neighbours come along";
  constexpr double as_written = 0.0051;  // two decimals
  EXPECT_TRUE(std::ranges::any_of(line["points"], [&](const json& placed) {
    return std::abs(placed[0].get<double>() - (column + 1.5)) < as_written;
  })) << line["points"];

  // A region is masked in all phases, and the outer edge pulled.
  click("[data-tool=mask]");
  click("#all-phases");
  browser->drag(in_window(0, {{55, 20}, {60, 18}, {70, 20}, {75, 30}, {66, 34}, {56, 30}}));
  wait_for_choices(2);
  EXPECT_EQ(choices()[1]["phase"], "all");
  click("[data-tool=outer]");
  const json edge = browser->value("desk.players[0].image.outlines[0].slice(0, 2)");
  const double toward = edge[0].get<double>() < 48 ? 2 : -2;
  browser->drag(in_window(0, {{edge[0], edge[1]}, {edge[0].get<double>() + toward, edge[1]}}));
  wait_for_choices(3);
  EXPECT_EQ(choices()[2]["contour"], "outer");
  EXPECT_GT(choices()[2]["points"].size(), 8U);
  screenshot("desk.png");

  // Undo takes back the last, and the list any; the file says so.
  click("#undo");
  wait_for_choices(2);
  EXPECT_EQ(choices()[3], (json{{"action", "undo"}}));
  click("#choices li button");
  wait_for_choices(1);
  EXPECT_EQ(choices()[4], (json{{"action", "undo"}, {"line", 1}}));

  const json before = browser->value("desk.players[0].image.points.length");
  browser->wait_until("!document.getElementById('track').disabled");
  click("#track");
  browser->wait_until("desk.state.version === 2 && !desk.state.tracking && desk.state.changed === 0");
  browser->wait_until("desk.players[0].image.points.length !== " + before.dump());
  EXPECT_EQ(browser->value("desk.players[0].phase"), 4) << "the picture stays where it was";
  const Ended track = run(place, {"diastole", "track", "gel/dicom", "-o", "again.tags.csv", "--json"});
  ASSERT_EQ(track.exit_code, 0) << track.err;
  EXPECT_EQ(track.json()["edits"]["applied"], (json{{"mask", 1}}));
  EXPECT_EQ(track.json()["edits"]["undone"], 2);
  EXPECT_GT(track.json()["dropped"]["masked by hand"], 0);
  const auto text = [&](const std::string& name) {
    std::ostringstream all;
    all << std::ifstream(place / name).rdbuf();
    return all.str();
  };
  EXPECT_EQ(text("gel.tags.csv"), text("again.tags.csv")) << "the desk tracks as `track` does";

  expect_a_good_page();
}

}  // namespace
}  // namespace diastole::flow
