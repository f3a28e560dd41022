#include <gmock/gmock.h>

#include "estimator/io/tracking_file.hpp"
#include "estimator/report/report.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::report {
namespace {

using testing::HasSubstr;

TrackingRecord two_phases() {
  TrackingRecord record;
  record.folder = "dicom/<gel>";
  record.coordinates = "patient";
  record.points = 3;
  record.rms_px = 0.02;
  record.dropped = {{"a ghost", 1}};
  TrackedSliceImages slice;
  slice.name = "series 2, slice 1";
  slice.view = "transverse";
  slice.rows = 2;
  slice.columns = 3;
  slice.pixel_mm = {1, 1};
  slice.directions = {{45, 5}};
  slice.images = {{1,
                   12,
                   0.015,
                   4.2,
                   base64("abcdef"),
                   {0, 7, 0.5, 1, 0.015, 0, 7, 1.5, 0, 0.0151},
                   {0, 0, 2, 1},
                   {{0, 0, 2, 0, 1, 1}}},
                  {2, 84, 0.025, 4.4, base64("ABCDEF"), {0, 7, 0.75, 1, 0.025}, {}}};
  record.slices = {slice};
  return record;
}

TEST(TrackingFile, Base64IsThatOfTheStandard) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xff\x00\xfe", 3)), "/wD+");
}

TEST(TrackingFile, IsReadAsItWasWritten) {
  const std::string text = to_json(two_phases());
  EXPECT_TRUE(is_tracking(text));
  EXPECT_EQ(to_json(tracking_record_from_json(text, "t.json")), text);
  TrackingRecord torn = two_phases();
  torn.slices[0].images[1].points.pop_back();
  EXPECT_THAT(test::message_of([&] { (void)tracking_record_from_json(to_json(torn), "t.json"); }),
              HasSubstr("list of points"));
  torn = two_phases();
  torn.slices[0].images[0].outlines[0].pop_back();
  EXPECT_THAT(test::message_of([&] { (void)tracking_record_from_json(to_json(torn), "t.json"); }),
              HasSubstr("outline"));
  torn = two_phases();
  torn.slices[0].rows = 3;
  EXPECT_THAT(test::message_of([&] { (void)tracking_record_from_json(to_json(torn), "t.json"); }),
              HasSubstr("as many pixels"));
}

TEST(TrackingPage, IsSelfContainedAndTellsWithoutScripts) {
  const std::string html = make_report(two_phases());
  EXPECT_THAT(html, HasSubstr("data-slice=\"0\""));
  EXPECT_THAT(html, HasSubstr("a ghost"));
  EXPECT_THAT(html, HasSubstr("0.025"));
  EXPECT_THAT(html, HasSubstr("&lt;gel&gt;"));
  EXPECT_THAT(html,
              testing::Not(testing::AnyOf(HasSubstr("http://"), HasSubstr("https://"), HasSubstr("<gel>"))));
}

TEST(TrackingPage, StandsBeforeTheFitInAReportAndOnlyOnce) {
  const test::ScratchFolder folder;
  const auto file = folder.write("t.json", to_json(two_phases()));
  EXPECT_THAT(make_report(std::vector{file}), HasSubstr("Images and tags"));
  EXPECT_THAT(test::message_of([&] {
                (void)make_report(std::vector{file, file});
              }),
              HasSubstr("second record"));
}

}  // namespace
}  // namespace diastole::report
