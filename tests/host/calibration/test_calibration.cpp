#include "host/calibration/calibration.hpp"

#include <gmock/gmock.h>

#include <fstream>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::vector<ChannelConfig> nominal{{"cavity", 4, 0}, {"pump", 10, 0.1}};

CalibrationPoint point(double volts, double kPa) {
  return {volts, kPa, "2026-01-02T03:04:05Z", "A. \"N\" \\"};
}

TEST(Calibration, WithoutAFileTheRigFileHolds) {
  const Scratch scratch("calibration");
  const CalibrationBook book(scratch / "rig.toml", nominal);
  EXPECT_DOUBLE_EQ(book.channels()[1].kPa_per_V, 10);
  EXPECT_DOUBLE_EQ(book.channels()[1].zero_V, 0.1);
  EXPECT_EQ(book.attributes().count("cavity_calibrated_utc"), 0U);
}

TEST(Calibration, TwoPointsMakeALineThatOutlivesTheDaemon) {
  const Scratch scratch("calibration");
  {
    CalibrationBook book(scratch / "rig.toml", nominal);
    book.add_point("cavity", point(0.5, 0));
    EXPECT_DOUBLE_EQ(book.channels()[0].kPa_per_V, 4) << "one point is no calibration";
    book.add_point("cavity", point(2.5, 10));
    book.save();
  }
  const CalibrationBook book(scratch / "rig.toml", nominal);
  EXPECT_EQ(book.file().filename(), "rig.calibration.toml");
  EXPECT_DOUBLE_EQ(book.channels()[0].kPa_per_V, 5);
  EXPECT_DOUBLE_EQ(book.channels()[0].zero_V, 0.5);
  EXPECT_DOUBLE_EQ(book.channels()[1].kPa_per_V, 10) << "the other channel is as it was";
  const auto attributes = book.attributes();
  EXPECT_EQ(std::get<std::string>(attributes.at("cavity_calibrated_by")), "A. \"N\" \\");
  EXPECT_EQ(std::get<std::string>(attributes.at("cavity_calibrated_utc")), "2026-01-02T03:04:05Z");
  EXPECT_DOUBLE_EQ(std::get<double>(attributes.at("cavity_kPa_per_V")), 5);
}

TEST(Calibration, AZeroMovesTheLineUntilTheNextCalibration) {
  const Scratch scratch("calibration");
  CalibrationBook book(scratch / "rig.toml", nominal);
  book.set_zero("cavity", point(0.07, 0));
  EXPECT_DOUBLE_EQ(book.channels()[0].zero_V, 0.07);
  EXPECT_DOUBLE_EQ(book.channels()[0].kPa_per_V, 4);
  EXPECT_EQ(std::get<std::string>(book.attributes().at("cavity_zeroed_utc")), "2026-01-02T03:04:05Z");
  book.save();
  EXPECT_DOUBLE_EQ(CalibrationBook(scratch / "rig.toml", nominal).channels()[0].zero_V, 0.07);
  book.add_point("cavity", point(1, 2));
  EXPECT_DOUBLE_EQ(book.channels()[0].zero_V, 0.07);
  book.add_point("cavity", point(2, 6));
  EXPECT_DOUBLE_EQ(book.channels()[0].zero_V, 0.5);
  book.add_point("cavity", point(0, 0));
  EXPECT_DOUBLE_EQ(book.channels()[0].kPa_per_V, 4) << "a third point begins anew";
}

TEST(Calibration, PointsThatMakeNoLineAreRefusedAndChangeNothing) {
  const Scratch scratch("calibration");
  CalibrationBook book(scratch / "rig.toml", nominal);
  book.add_point("cavity", point(0.5, 0));
  EXPECT_THAT(message_of<InputError>([&] { book.add_point("cavity", point(0.5, 10)); }),
              AllOf(HasSubstr("cavity"), HasSubstr("no line")));
  EXPECT_THROW(book.add_point("cavity", point(0.72, 10)), InputError) << "2.5 V were to be expected";
  EXPECT_THROW(book.add_point("cavity", point(2, 0)), InputError);
  EXPECT_EQ(book.of("cavity").points.size(), 1U);
  EXPECT_THAT(message_of<InputError>([&] { book.set_zero("spare", point(0, 0)); }),
              AllOf(HasSubstr("spare"), HasSubstr("cavity, pump")));
}

TEST(Calibration, AFileThatCannotBeReplacedIsAHardwareError) {
  const Scratch scratch("calibration");
  CalibrationBook book(scratch / "rig.toml", nominal);
  book.set_zero("cavity", point(0.07, 0));
  std::filesystem::create_directories(scratch / "rig.calibration.toml/in-the-way");
  EXPECT_THROW(book.save(), HardwareError);
}

TEST(Calibration, MistakesInTheFileAreNamedWithTheirPlace) {
  const Scratch scratch("calibration");
  std::ofstream(scratch / "rig.calibration.toml")
      << "format = \"diastole-calibration\"\nversion = 1\n[channel.cavity]\nzero = { volt = 1.0 }\n";
  EXPECT_THAT(message_of<InputError>([&] { CalibrationBook(scratch / "rig.toml", nominal); }),
              AllOf(HasSubstr("rig.calibration.toml"), HasSubstr("volt")));
}

}  // namespace
}  // namespace diastole
