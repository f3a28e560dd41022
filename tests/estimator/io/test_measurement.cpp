#include <gmock/gmock.h>

#include <cmath>

#include "estimator/io/measurement.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::HasSubstr;

constexpr const char* tags_header = "frame,nx,ny,nz,plane_mm,x_mm,y_mm,z_mm,sigma_mm\n";
constexpr const char* frames_header = "frame,time_s,pressure_kPa,sigma_kPa\n";
constexpr const char* points_header = "frame,X_mm,Y_mm,Z_mm,x_mm,y_mm,z_mm,sigma_mm\n";

class MeasurementFile : public testing::Test {
 protected:
  std::vector<TagPoint> tags(const std::string& content) {
    return read_tags(folder_.write("t.csv", content), 3);
  }
  std::vector<Frame> frames(const std::string& content) {
    return read_frames(folder_.write("f.csv", content));
  }
  std::string tag_row_fault(const std::string& row) {
    return message_of([&] { (void)tags(tags_header + row); });
  }
  std::string frames_fault(const std::string& rows) {
    return message_of([&] { (void)frames(frames_header + rows); });
  }
  test::ScratchFolder folder_;
};

TEST_F(MeasurementFile, TagsArriveWhateverTheLineEnding) {
  const std::string row = "2,0.707107,-0.707107,0,-42.1812,-24.5448,-33.2650,-30.8842,0.8";
  for (const char* end : {"", "\n", "\r\n", "\n\n"}) {
    const std::vector<TagPoint> read = tags(tags_header + row + end);
    ASSERT_EQ(read.size(), 1U);
    EXPECT_EQ(read[0].frame, 2);
    EXPECT_DOUBLE_EQ(read[0].normal[0], std::sqrt(0.5));
    EXPECT_DOUBLE_EQ(read[0].normal[1], -std::sqrt(0.5));
    EXPECT_EQ(read[0].plane_mm, -42.1812);
    EXPECT_THAT(read[0].x_mm, testing::ElementsAre(-24.5448, -33.2650, -30.8842));
    EXPECT_EQ(read[0].sigma_mm, 0.8);
  }
}

TEST_F(MeasurementFile, TagFaultsNameLineColumnAndValue) {
  const std::string good = "1,1,0,0,5,24,0,0,0.8\n";
  EXPECT_THAT(tag_row_fault(good + "1,1,0,0,5,abc,0,0,0.8\n"),
              AllOf(HasSubstr("line 3, column x_mm"), HasSubstr("\"abc\"")));
  EXPECT_THAT(tag_row_fault(good + "1,1,0,0,nan,24,0,0,0.8\n"),
              AllOf(HasSubstr("line 3, column plane_mm"), HasSubstr("nan")));
  EXPECT_THAT(tag_row_fault("1,1,0,0,inf,24,0,0,0.8\n"), HasSubstr("line 2, column plane_mm"));
  EXPECT_THAT(tag_row_fault("1,1,0,0,5,24,0,0\n"),
              AllOf(HasSubstr("line 2"), HasSubstr("8 columns where 9 belong")));
  EXPECT_THAT(tag_row_fault("1,1,0,0,5,24,0,0,0.8,7\n"), HasSubstr("more than the 9 columns"));
  EXPECT_THAT(tag_row_fault("1,1,0,0,5,24,0,0,0.8,\n"), HasSubstr("more than the 9 columns"));
  EXPECT_THAT(tag_row_fault("1,1,0,0,,24,0,0,0.8\n"), HasSubstr("column plane_mm"));
  EXPECT_THAT(tag_row_fault("1,1,0.1,0,5,24,0,0,0.8\n"),
              AllOf(HasSubstr("length 1.00499"), HasSubstr("unit normal")));
  EXPECT_THAT(tag_row_fault("3,1,0,0,5,24,0,0,0.8\n"),
              AllOf(HasSubstr("column frame"), HasSubstr("frame 3 has no row")));
  EXPECT_THAT(tag_row_fault("1.5,1,0,0,5,24,0,0,0.8\n"), HasSubstr("1.5 is not a whole number"));
  EXPECT_THAT(tag_row_fault("1,1,0,0,5,24,0,0,-0.8\n"),
              AllOf(HasSubstr("column sigma_mm"), HasSubstr("-0.8")));
  EXPECT_THAT(tag_row_fault("1,1,0,0,5,24,0,0,0\n"), HasSubstr("column sigma_mm"));
  EXPECT_THAT(tag_row_fault(good + "\n" + good), AllOf(HasSubstr("line 3"), HasSubstr("blank line")));
}

TEST_F(MeasurementFile, HeaderAndEmptinessAreChecked) {
  EXPECT_THAT(message_of([&] { (void)tags(""); }), HasSubstr("the file is empty"));
  EXPECT_THAT(message_of([&] { (void)tags(tags_header); }), HasSubstr("no row"));
  EXPECT_THAT(
      message_of([&] { (void)tags("frame,nx,ny,nz,plane,x_mm,y_mm,z_mm,sigma_mm\n1,1,0,0,5,24,0,0,1\n"); }),
      AllOf(HasSubstr("line 1"), HasSubstr("\"plane\" where \"plane_mm\" belongs")));
  EXPECT_THAT(message_of([&] { (void)tags("1,1,0,0,5,24,0,0,0.8\n"); }),
              HasSubstr("The header must read: frame,nx"));
  EXPECT_THAT(message_of([&] { (void)tags("frame,nx,ny,nz,plane_mm,x_mm,y_mm,z_mm,sigma_mm,more\n"); }),
              HasSubstr("a column too many: \"more\""));
  EXPECT_THAT(message_of([&] { (void)tags("frame,nx,ny,nz,plane_mm,x_mm,y_mm,z_mm,sigma_mm,own_mm\n"); }),
              HasSubstr("\"\" where \"own_sigma_mm\" belongs"));
  EXPECT_THAT(message_of([&] { (void)read_tags(folder_.path() / "none.csv", 3); }),
              AllOf(HasSubstr("none.csv"), HasSubstr("cannot be opened")));
}

TEST_F(MeasurementFile, TrackedTagsAreReadAsTheirOwnPixelsHaveThem) {
  const std::string header = "frame,nx,ny,nz,plane_mm,x_mm,y_mm,z_mm,sigma_mm,own_mm,own_sigma_mm\n";
  bool as_seen = false;
  const auto read =
      read_tags(folder_.write("own.csv", header + "1,0,1,0,5,24,6,0,0.02,-0.25,0.125\n"), 3, &as_seen);
  EXPECT_TRUE(as_seen);
  EXPECT_EQ(read[0].x_mm, (std::array<double, 3>{24, 5.75, 0}));
  EXPECT_EQ(read[0].sigma_mm, 0.125);
  (void)read_tags(folder_.write("plain.csv", std::string(tags_header) + "1,0,1,0,5,24,6,0,0.02\n"), 3,
                  &as_seen);
  EXPECT_FALSE(as_seen);
}

TEST_F(MeasurementFile, FramesMustBeContiguousIncreasingAndPlausible) {
  EXPECT_EQ(frames(std::string(frames_header) + "0,0,0,0.02\n1,0.26,0.6,0.02\n").size(), 2U);
  EXPECT_THAT(frames_fault("0,0,0,0.02\n2,0.26,0.6,0.02\n"),
              AllOf(HasSubstr("line 3"), HasSubstr("frame 2 where frame 1")));
  EXPECT_THAT(frames_fault("1,0,0,0.02\n"), HasSubstr("frame 1 where frame 0"));
  EXPECT_THAT(frames_fault("0,0.3,0,0.02\n1,0.26,0.6,0.02\n"),
              AllOf(HasSubstr("column time_s"), HasSubstr("0.26")));
  EXPECT_THAT(frames_fault("0,0,0,-0.02\n"), AllOf(HasSubstr("column sigma_kPa"), HasSubstr("-0.02")));
  EXPECT_THAT(frames_fault("0,0,0,0\n1,1,3100,0\n"),
              AllOf(HasSubstr("column pressure_kPa"), HasSubstr("Pa divide by 1000")));
}

TEST_F(MeasurementFile, CoordinatesInMetresOrOtherAxesAreRefused) {
  Study study;
  study.specimen = AnnulusSpecimen{22.5, 50, 85, {8, 4, 1}, "fixed"};
  study.data.frames = folder_.write("f.csv", std::string(frames_header) + "0,0,0,0.02\n1,0.26,0.6,0.02\n");
  const auto fault_of = [&](const char* rows) {
    study.data.points = folder_.write("p.csv", std::string(points_header) + rows);
    return message_of([&] { (void)read_measurement(study); });
  };
  EXPECT_EQ(fault_of("1,30,0,0,31,0,0,0.8\n"), "(no error)");
  EXPECT_THAT(fault_of("1,0.03,0,0,0.031,0,0,0.0008\n"), HasSubstr("metres"));
  EXPECT_THAT(fault_of("1,30,0,300,31,0,300,0.8\n"), HasSubstr("outside the specimen"));
}

TEST(ExampleMeasurement, HasEveryRow) {
  const std::filesystem::path examples = std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples";
  const Measurement tags = read_measurement(read_study(examples / "phantom-a.study.toml"));
  EXPECT_EQ(tags.frames.size(), 6U);
  EXPECT_EQ(tags.tags.size(), 13866U);
  const Measurement points = read_measurement(read_study(examples / "phantom-a-points.study.toml"));
  EXPECT_EQ(points.points.size(), 10000U);
}

}  // namespace
}  // namespace diastole
