#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "estimator/imaging/tracking/manual_edits.hpp"
#include "estimator/imaging/tracking/outline.hpp"
#include "estimator/imaging/tracking/tags_file.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::imaging {
namespace {

using test::RingScan;
using test::ScratchFolder;
using testing::AllOf;
using testing::HasSubstr;

using Points = std::vector<Eigen::Vector2d>;

/// A ring's images and the choices about them, tracked anew each time.
class EditedRing {
 public:
  explicit EditedRing(const RingScan& ring) : scan(ring) {
    std::filesystem::create_directory(folder());
    test::write_ring(scan, folder());
  }
  [[nodiscard]] std::filesystem::path folder() const { return scratch_.path() / "dicom"; }
  [[nodiscard]] TrackedFolder track(const std::string& edits) const {
    scratch_.write("dicom.edits.jsonl", edits);
    return track_folder({.folder = folder(), .coordinates = "patient"});
  }
  [[nodiscard]] std::string refusal(const std::string& edits) const {
    return test::message_of([&] { (void)track(edits); });
  }
  [[nodiscard]] double radius_mm(const TrackedPoint& point) const { return point.x_mm.head<2>().norm(); }

  RingScan scan;

 private:
  ScratchFolder scratch_;
};

std::string choice(const std::string& action, const std::string& phase, const std::string& more,
                   const Points& points_px) {
  std::string text = fmt::format(
      R"({{"slice": "series 2, slice 1", "phase": {}, "action": "{}", {}"points": [)", phase, action, more);
  for (size_t i = 0; i < points_px.size(); ++i)
    text += fmt::format("{}[{:.2f}, {:.2f}]", i > 0 ? ", " : "", points_px[i].x(), points_px[i].y());
  return text + "]}\n";
}

std::string circle(const RingScan& scan, int phase, const std::string& contour, double radius_mm) {
  Points points;
  for (int i = 0; i < 72; ++i) {
    const double angle = 2 * std::numbers::pi * i / 72;
    points.emplace_back(
        (radius_mm * Eigen::Vector2d(std::cos(angle), std::sin(angle)) - scan.origin_mm.head<2>()) /
        scan.pixel_mm);
  }
  return choice("contour", std::to_string(phase), fmt::format(R"("contour": "{}", )", contour), points);
}

/// The tags of points that are off by half a spacing and more, with how many points.
struct WrongPoints {
  std::set<int> tags;
  size_t count = 0;
};

WrongPoints wrong_points(const RingScan& scan, const TrackedFolder& tracked, int first, int last) {
  WrongPoints wrong;
  for (const TrackedPoint& point : tracked.points) {
    const double off_mm = scan.material_mm(point.frame, point.x_mm) - point.plane_mm;
    if (point.frame < first || point.frame > last || std::abs(off_mm) < 0.5 * scan.tag_spacing_mm) continue;
    ++wrong.count;
    wrong.tags.insert(point.tag);
  }
  return wrong;
}

/// Where the tag of a plane is truly seen in the ring, as pixels.
std::vector<Eigen::Vector2d> true_line_px(const RingScan& scan, int frame, double plane_mm) {
  std::vector<Eigen::Vector2d> places;
  const Eigen::Vector2d normal = scan.normal().head<2>(), along(-normal.y(), normal.x());
  const double c = scan.inflation_mm2(frame);
  for (double s = -45; s <= 45; s += 1) {
    double across = plane_mm;
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d x = across * normal + s * along;
      across -= scan.material_mm(frame, {x.x(), x.y(), 0}) - plane_mm;
    }
    const Eigen::Vector2d x = across * normal + s * along;
    const double inner = std::sqrt(RingScan{}.inner_mm * RingScan{}.inner_mm + c) + 2;
    const double outer = std::sqrt(RingScan::outer_mm * RingScan::outer_mm + c) - 2;
    if (x.norm() > inner && x.norm() < outer)
      places.push_back((x - scan.origin_mm.head<2>()) / scan.pixel_mm);
  }
  return places;
}

double plane_of(const TrackedFolder& tracked, int tag) {
  for (const TrackedPoint& point : tracked.points) {
    if (point.tag == tag) return point.plane_mm;
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// So fast that lines jump to the next stripe: a point moves by up to a spacing from phase to phase.
const RingScan fast{.phases = 10, .tag_spacing_mm = 4.0, .most_mm2 = 280.0};

TEST(ManualEdits, DraggedLinesArePutRightInTheirPhaseAndInItsNeighbours) {
  const EditedRing ring(fast);
  const TrackedFolder before = ring.track("");
  EXPECT_FALSE(before.edits);
  constexpr int phase = 6;
  const WrongPoints wrong = wrong_points(ring.scan, before, phase, phase);
  ASSERT_GT(wrong.count, 20U) << "nothing is there to be put right";
  ASSERT_GT(wrong_points(ring.scan, before, 5, 8).count, 100U);
  std::string edits;
  for (const int tag : wrong.tags) {
    const Points line = true_line_px(ring.scan, phase, plane_of(before, tag));
    if (!line.empty()) edits += choice("line", "6", fmt::format("\"tag\": {}, ", tag), line);
  }
  const TrackedFolder after = ring.track(edits);
  ASSERT_TRUE(after.edits);
  EXPECT_EQ(after.edits->counts.at("line"), std::count(edits.begin(), edits.end(), '\n'));
  EXPECT_EQ(wrong_points(ring.scan, after, 5, 8).count, 0U);
  EXPECT_GT(after.points.size(), before.points.size());
}

TEST(ManualEdits, MaskedPixelsDoNotCountAndTheirPointsAreCounted) {
  const EditedRing ring(RingScan{});
  const Points corner = {{60, 60}, {95, 60}, {95, 95}, {60, 95}};
  const auto in_corner = [&](const TrackedFolder& tracked, int frame) {
    return std::count_if(tracked.points.begin(), tracked.points.end(), [&](const TrackedPoint& point) {
      const Eigen::Vector3d from = point.x_mm - ring.scan.origin_mm;
      return point.frame == frame && from.x() > 60.5 && from.y() > 60.5;
    });
  };
  const TrackedFolder one = ring.track(choice("mask", "3", "", corner));
  EXPECT_EQ(in_corner(one, 3), 0);
  EXPECT_GT(in_corner(one, 4), 10);
  const size_t dropped = one.dropped.at("masked by hand");
  EXPECT_GT(dropped, 10U);
  const TrackedFolder all = ring.track(choice("mask", "\"all\"", "", corner));
  for (int frame = 1; frame <= ring.scan.phases; ++frame)
    EXPECT_EQ(in_corner(all, frame), 0) << frame;
  EXPECT_GT(all.dropped.at("masked by hand"), 6 * dropped);
  // What is masked says nothing: elsewhere the tags are where they were.
  EXPECT_EQ(wrong_points(ring.scan, all, 1, ring.scan.phases).count, 0U);
}

TEST(ManualEdits, ContoursSayWhatIsTissueInTheirPhase) {
  const EditedRing ring(RingScan{});
  const auto radii = [&](const TrackedFolder& tracked, int frame) {
    double least = 1e9, most = 0;
    for (const TrackedPoint& point : tracked.points) {
      if (point.frame != frame) continue;
      least = std::min(least, ring.radius_mm(point));
      most = std::max(most, ring.radius_mm(point));
    }
    return std::pair(least, most);
  };
  const TrackedFolder found = ring.track("");
  const TrackedFolder drawn =
      ring.track(circle(ring.scan, 4, "outer", 33) + circle(ring.scan, 4, "inner", 26));
  EXPECT_LT(radii(found, 4).first, 24);
  EXPECT_GT(radii(found, 4).second, 35);
  EXPECT_GT(radii(drawn, 4).first, 25.5);
  EXPECT_LT(radii(drawn, 4).second, 33.5);
  EXPECT_GT(radii(drawn, 5).second, 34) << "the contour is that of one phase";
  EXPECT_GT(radii(drawn, 7).second, 36);
  EXPECT_NEAR(radii(drawn, 7).first, radii(found, 7).first, 0.1);
  // Of one contour alone the other edge is as found.
  const TrackedFolder inner = ring.track(circle(ring.scan, 4, "inner", 26));
  EXPECT_GT(radii(inner, 4).first, 25.5);
  EXPECT_GT(radii(inner, 4).second, 35);
  const TrackedFolder outer = ring.track(circle(ring.scan, 4, "outer", 33));
  EXPECT_LT(radii(outer, 4).first, 24);
  EXPECT_LT(radii(outer, 4).second, 33.5);
}

TEST(ManualEdits, AreReplayedInTheirOrder) {
  const EditedRing ring(RingScan{.phases = 3});
  const std::string narrow = circle(ring.scan, 2, "outer", 30), wide = circle(ring.scan, 2, "outer", 34);
  const auto text = [&](const std::string& edits) { return tags_file_text(ring.track(edits).points); };
  const std::string as_narrow = text(narrow), as_wide = text(wide), as_found = text("");
  EXPECT_NE(as_narrow, as_wide);
  EXPECT_EQ(text(wide + narrow), as_narrow);
  EXPECT_EQ(text(narrow + wide), as_wide);
  EXPECT_EQ(text(narrow + wide + "{\"action\": \"undo\"}\n"), as_narrow);
  EXPECT_EQ(text(narrow + wide + "{\"action\": \"undo\", \"line\": 1}\n"), as_wide);
  const TrackedFolder undone =
      ring.track(narrow + wide + "{\"action\": \"undo\"}\n\n{\"action\": \"undo\"}\n");
  EXPECT_EQ(tags_file_text(undone.points), as_found);
  EXPECT_EQ(undone.edits->undone, 2U);
}

TEST(ManualEdits, WeighALineByItsLengthAndTheLaterOverTheEarlier) {
  TagView view;
  view.name = "series 1, slice 1";
  view.plane.rows = view.plane.columns = 64;
  view.images.assign(2, Image::Zero(64, 64));
  view.frames = {1, 2};
  view.waves = {{{0.2, 0.0}, 0.25, 1, 1}};
  std::vector<TagView> views = {view};
  const auto apply = [&](const std::string& text) {
    apply_edits(parse_edits(text, "a.edits.jsonl"), views);
    return views[0].edits[1].seen;
  };
  const std::string head =
      R"({"slice": "series 1, slice 1", "phase": 2, "action": "line", "tag": 4, "points": )";
  EXPECT_EQ(apply(head + "[[21, 10], [21, 30]]}").size(), 5U);
  std::string dense = head + "[";
  for (int i = 0; i <= 80; ++i)
    dense += fmt::format("{}[21, {}]", i > 0 ? ", " : "", 10 + 0.25 * i);
  EXPECT_EQ(apply(dense + "]}").size(), 5U);
  const auto both = apply(head + "[[21, 10], [21, 30]]}\n" + head + "[[23, 31]]}");
  ASSERT_EQ(both.size(), 5U);
  EXPECT_EQ(both.back().x_mm, Eigen::Vector2d(23, 31));
}

TEST(ManualEdits, RefusesWhatDoesNotFitWithFileLineValueAndRemedy) {
  const EditedRing ring(RingScan{.phases = 3});
  const std::string good = choice("mask", "1", "", {{1, 1}, {5, 1}, {5, 5}});
  const std::string slice = R"("slice": "series 2, slice 1", )";
  const std::vector<std::pair<std::string, std::vector<std::string>>> bad = {
      {"{\"action\": \"mask\"", {"no JSON", "delete"}},
      {"[1, 2]", {"no JSON object"}},
      {"{\"slice\": 3}", {"\"action\" is missing", "undo"}},
      {"{\"action\": \"drag\"}", {"\"drag\"", "line, mask, contour, height or undo"}},
      {"{\"action\": \"mask\", \"phase\": 1}", {"\"slice\" is missing"}},
      {R"({"action": "mask", "slice": "series 2, slice 9", "phase": 1, "points": [[1,1],[5,1],[5,5]]})",
       {"series 2, slice 9", "Did you mean", "series 2, slice 1"}},
      {"{" + slice + R"("action": "mask", "phase": 7, "points": [[1,1],[5,1],[5,5]]})",
       {"phase 7", "1, 2, 3"}},
      {"{" + slice + R"("action": "mask", "phase": 1.5, "points": [[1,1],[5,1],[5,5]]})",
       {"1.5", "whole number"}},
      {"{" + slice + R"("action": "mask", "phase": 1, "points": [[1,1],[5,1]]})", {"2 points", "3"}},
      {"{" + slice + R"("action": "mask", "phase": 1, "points": [[1,1],[5,1],[500,5]]})",
       {"[500, 5]", "0 to 95"}},
      {"{" + slice + R"("action": "mask", "phase": 1, "points": [[1,1],["a",1],[5,5]]})",
       {"[\"a\",1]", "column"}},
      {"{" + slice + R"("action": "mask", "phase": 1, "tag": 2, "points": [[1,1],[5,1],[5,5]]})",
       {"\"tag\"", "points"}},
      {"{" + slice +
           R"("action": "contour", "phase": "all", "contour": "inner", "points": [[1,1],[5,1],[5,5]]})",
       {"\"all\""}},
      {"{" + slice + R"("action": "contour", "phase": 1, "contour": "endo", "points": [[1,1],[5,1],[5,5]]})",
       {"endo", "inner"}},
      {"{" + slice + R"("action": "line", "phase": 1, "tag": 400, "points": [[1,1]]})", {"tag 400", "Tags"}},
      {"{" + slice + R"("action": "line", "phase": 1, "tag": 4, "direction": 2, "points": [[1,1]]})",
       {"direction 2", "numbered from 1"}},
      {"{" + slice + R"("action": "height", "height_mm": "middle"})", {"\"middle\"", "mid-height"}},
      {"{" + slice + R"("action": "height"})", {"\"height_mm\" is missing", "mid-height"}},
      {"{\"action\": \"undo\", \"line\": 2}", {"line 2", "undone"}},
      {"{\"action\": \"undo\"}\n{\"action\": \"undo\"}", {"nothing is left"}}};
  for (const auto& [line, words] : bad) {
    const std::string said = ring.refusal(good + line + "\n");
    EXPECT_THAT(said, AllOf(HasSubstr("dicom.edits.jsonl: line "), HasSubstr("\n  "))) << line;
    EXPECT_THAT(said, testing::AnyOf(HasSubstr("line 2:"), HasSubstr("line 3:"))) << line;
    for (const std::string& word : words)
      EXPECT_THAT(said, HasSubstr(word)) << line;
  }
  EXPECT_THAT(
      test::message_of([&] {
        (void)track_folder({.folder = ring.folder(), .coordinates = "patient", .edits = "none.edits.jsonl"});
      }),
      HasSubstr("none.edits.jsonl"));
}

TEST(Outlines, AreClosedCurvesOfARingsEdges) {
  Eigen::ArrayXXf depth(64, 80);
  for (Eigen::Index column = 0; column < depth.cols(); ++column) {
    for (Eigen::Index row = 0; row < depth.rows(); ++row) {
      const double radius = std::hypot(static_cast<double>(column) - 40, static_cast<double>(row) - 32);
      depth(row, column) = static_cast<float>(std::min(24 - radius, radius - 10));
    }
  }
  const auto curves = outlines_px(depth);
  ASSERT_EQ(curves.size(), 2U);
  for (const Points& curve : curves) {
    const double radius = (curve[0] - Eigen::Vector2d(40, 32)).norm() > 17 ? 24 : 10;
    EXPECT_NEAR(static_cast<double>(curve.size()), 2 * std::numbers::pi * radius / 3, 1);
    for (const Eigen::Vector2d& point : curve)
      EXPECT_NEAR((point - Eigen::Vector2d(40, 32)).norm(), radius, 0.15);
  }
  EXPECT_EQ(outlines_px(Eigen::ArrayXXf::Constant(20, 20, 1.0F)).size(), 1U) << "closed by the border";
  EXPECT_TRUE(outlines_px(Eigen::ArrayXXf::Constant(20, 20, -1.0F)).empty());
}

TEST(ManualEdits, StandBesideTheFolder) {
  EXPECT_EQ(edits_beside("/data/gel/dicom").string(), "/data/gel/dicom.edits.jsonl");
  EXPECT_EQ(edits_beside("/data/gel/dicom/").string(), "/data/gel/dicom.edits.jsonl");
}

}  // namespace
}  // namespace diastole::imaging
