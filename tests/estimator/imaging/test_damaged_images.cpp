// Images that are spoilt, cut off, in the wrong place or there twice.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcpixseq.h>
#include <dcmtk/dcmdata/dcpxitem.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gmock/gmock.h>

#include <fstream>
#include <functional>
#include <random>

#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/series/phase_order.hpp"
#include "tests/estimator/imaging/finding_ids.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::imaging {
namespace {

namespace fs = std::filesystem;
using test::finding_ids;
using test::RingScan;
using test::ScratchFolder;
using test::write_ring;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

using Pixels = std::vector<Uint16>;

Pixels pixels_of(const fs::path& path) {
  DcmFileFormat file;
  const Uint16* values = nullptr;
  unsigned long count = 0;
  EXPECT_TRUE(file.loadFile(path.c_str()).good());
  EXPECT_TRUE(file.getDataset()->findAndGetUint16Array(DCM_PixelData, values, &count).good());
  return {values, values + count};
}

void rewrite(const fs::path& path, const Pixels& pixels, const std::function<void(DcmDataset&)>& also = {}) {
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(path.c_str()).good());
  ASSERT_TRUE(file.loadAllDataIntoMemory().good());
  DcmDataset& data = *file.getDataset();
  ASSERT_TRUE(
      data.putAndInsertUint16Array(DCM_PixelData, pixels.data(), static_cast<unsigned long>(pixels.size()))
          .good());
  if (also) also(data);
  ASSERT_TRUE(file.saveFile(path.c_str(), EXS_LittleEndianExplicit).good());
}

TEST(DamagedImages, APhaseThatIsBlankOrAnotherOnesIsLeftOut) {
  const ScratchFolder scratch;
  const RingScan scan{.phases = 12};
  const auto files = write_ring(scan, scratch.path());
  const Pixels right = pixels_of(files[3]);
  const auto reported = [&](const Pixels& wrong, size_t left = 11) {
    rewrite(files[3], wrong);
    const ImageFolder folder = read_image_folder(scratch.path());
    EXPECT_EQ(folder.series.at(0).slices.at(0).images.size(), left);
    EXPECT_NO_THROW(require_sound(folder));  // it is tracked across the gap
    return finding_ids(folder);
  };
  EXPECT_THAT(reported(Pixels(right.size(), 0)), ElementsAre("phase-unlike"));
  Pixels moved = right;
  std::rotate(moved.begin(), moved.begin() + 3, moved.end());  // by three pixels
  EXPECT_THAT(reported(moved), ElementsAre("phase-unlike"));
  // Which of the two it is nobody knows.
  EXPECT_THAT(reported(pixels_of(files[2]), 10), ElementsAre("phase-copied", "phase-copied"));
}

TEST(DamagedImages, TimesThatAreExchangedOrRunBackwardsAreRefused) {
  const ScratchFolder scratch;
  const RingScan scan{.phases = 16, .most_mm2 = 250};
  const auto files = write_ring(scan, scratch.path());
  const auto reported = [&](auto time_ms) {
    for (int phase = 1; phase <= scan.phases; ++phase) {
      const fs::path& path = files[static_cast<size_t>(phase) - 1];
      rewrite(path, pixels_of(path), [&](DcmDataset& data) {
        data.putAndInsertString(DCM_TriggerTime, std::to_string(time_ms(phase)).c_str());
      });
    }
    return test::message_of([&] { require_sound(read_image_folder(scratch.path())); });
  };
  EXPECT_THAT(reported([&](int phase) {
                return scan.time_ms(phase == 4 ? 7 : phase == 7 ? 4 : phase);
              }),
              HasSubstr("the images at 228 and 444 ms seem to have each other's time"));
  EXPECT_THAT(reported([&](int phase) { return scan.time_ms(scan.phases + 1 - phase); }),
              HasSubstr("the order of time is wrong"));
}

TEST(DamagedImages, NeighboursOfWhichEachHasTheOthersTimeAreFoundInAMotionThatGoesOn) {
  const ScratchFolder scratch;
  const RingScan scan{.phases = 16};
  const auto files = write_ring(scan, scratch.path());
  const auto swap_times = [&](int one, int other) {
    for (const auto& [phase, time] : {std::pair(one, other), std::pair(other, one)}) {
      const fs::path& path = files[static_cast<size_t>(phase) - 1];
      rewrite(path, pixels_of(path), [&, at = time](DcmDataset& data) {
        data.putAndInsertString(DCM_TriggerTime, std::to_string(scan.time_ms(at)).c_str());
      });
    }
    return finding_ids(read_image_folder(scratch.path()));
  };
  for (const int phase : {4, 5, 11, 12}) {
    EXPECT_THAT(swap_times(phase, phase + 1), ElementsAre("phases-exchanged")) << phase;
    write_ring(scan, scratch.path());
  }
}

TEST(DamagedImages, ALastPhaseThatIsUnlikeAllOthersIsLeftOut) {
  const ScratchFolder scratch;
  const auto files = write_ring({.phases = 12}, scratch.path());
  Pixels moved = pixels_of(files.back());
  std::rotate(moved.begin(), moved.begin() + 3, moved.end());
  rewrite(files.back(), moved);
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(folder), ElementsAre("phase-unlike"));
  EXPECT_EQ(folder.series.at(0).slices.at(0).images.size(), 11U);
}

/// A stripe pattern that is shifted by `moved` and fades, with noise.
std::vector<Image> shifted_stripes(const std::vector<double>& moved, std::mt19937& random) {
  std::normal_distribution<float> noise(0.0F, 0.05F);
  std::vector<Image> phases;
  for (size_t phase = 0; phase < moved.size(); ++phase) {
    const double depth = 1.0 - 0.2 * static_cast<double>(phase) / static_cast<double>(moved.size());
    Image image(64, 64);
    for (Eigen::Index row = 0; row < 64; ++row)
      for (Eigen::Index column = 0; column < 64; ++column)
        image(row, column) =
            static_cast<float>(depth * std::cos(static_cast<double>(column) - moved[phase])) + noise(random);
    phases.push_back(std::move(image));
  }
  return phases;
}

TEST(DamagedImages, ACineThatMostlyRestsKeepsItsOrder) {
  std::mt19937 random(5);
  for (int draw = 0; draw < 6; ++draw) {
    std::vector<double> moved(20, 0.0);
    moved[8] = 0.5;
    moved[9] = 1.0;
    moved[10] = 0.5;
    EXPECT_FALSE(order_of_phases(shifted_stripes(moved, random)).exchange) << draw;
  }
}

TEST(DamagedImages, AMotionThatFallsFasterThanItRisesKeepsItsOrder) {
  std::mt19937 random(3);
  for (const int falling : {1, 2, 4, 8}) {
    std::vector<double> moved;
    for (int phase = 0; phase < 16; ++phase) {
      const int rising = 15 - falling;
      moved.push_back(phase <= rising ? static_cast<double>(phase) / rising
                                      : static_cast<double>(15 - phase) / falling);
    }
    std::vector<Image> phases = shifted_stripes(moved, random);
    const PhaseOrder order = order_of_phases(phases);
    EXPECT_FALSE(order.exchange) << falling;
    EXPECT_EQ(order.kept.size(), 16U) << falling;
    if (falling == 1) continue;  // one step is most of the motion
    std::swap(phases[4], phases[5]);
    EXPECT_TRUE(order_of_phases(phases).exchange) << falling;
  }
}

TEST(DamagedImages, PhasesThatAreAllOneImageAreRefused) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  for (const fs::path& file : files)
    rewrite(file, pixels_of(files[0]));
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("all 8 images of this slice have the same pixels"));
}

TEST(DamagedImages, ASeriesThatEndsBeforeTheOthersIsTold) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  const auto files = write_ring({.tag_angle_deg = 135, .series = 3}, scratch.path(), "other");
  for (const size_t lost : {5U, 6U, 7U})
    fs::remove(files[lost]);
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(folder), ElementsAre("phases-fewer"));
  EXPECT_THAT(folder.problems.at(0).what, HasSubstr("has 5 phases, from 12 to 300 ms, and series 2 has 8"));
}

TEST(DamagedImages, ASlopeOfZeroIsRefused) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  rewrite(files[2], pixels_of(files[2]),
          [](DcmDataset& data) { data.putAndInsertString(DCM_RescaleSlope, "0"); });
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("a rescale slope of 0 makes frame 1 blank"));
}

TEST(DamagedImages, NoSoundPhaseIsLeftOut) {
  for (const double noise : {0.5, 10.0, 40.0, 150.0}) {
    for (const double inflation_mm2 : {0.0, 20.0, 250.0}) {
      const ScratchFolder scratch;
      write_ring({.phases = 16, .noise = noise, .most_mm2 = inflation_mm2}, scratch.path());
      EXPECT_THAT(finding_ids(read_image_folder(scratch.path())), IsEmpty()) << noise << " " << inflation_mm2;
    }
  }
}

TEST(DamagedImages, ASeriesThatIsThereTwiceCountsOnce) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  write_ring({.series = 3}, scratch.path(), "again");
  write_ring({.series = 4, .seed = 2}, scratch.path(), "repeated");  // other noise: a measurement of its own
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(folder), ElementsAre("series-twice"));
  ASSERT_EQ(folder.series.size(), 2U);
  EXPECT_EQ(folder.series[1].number, 4);
}

TEST(DamagedImages, AnotherImagesIdentityIsToldOnce) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  fs::copy_file(files[0], scratch.path() / "copy.dcm");  // the same image is no riddle
  for (const size_t image : {2U, 3U})
    rewrite(files[image], pixels_of(files[image]), [&](DcmDataset& data) {
      DcmFileFormat first;
      OFString uid;
      ASSERT_TRUE(first.loadFile(files[1].c_str()).good());
      ASSERT_TRUE(first.getDataset()->findAndGetOFString(DCM_SOPInstanceUID, uid).good());
      data.putAndInsertString(DCM_SOPInstanceUID, uid.c_str());
    });
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(folder), UnorderedElementsAre("instance-twice", "copy"));
  EXPECT_EQ(folder.series.at(0).slices.at(0).images.size(), files.size());
}

TEST(DamagedImages, ARunLengthThatEndsEarlyOrLateIsRefused) {
  DcmRLEEncoderRegistration::registerCodecs();
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(files[2].c_str()).good());
  ASSERT_TRUE(file.getDataset()->chooseRepresentation(EXS_RLELossless, nullptr).good());
  DcmElement* element = nullptr;
  ASSERT_TRUE(file.getDataset()->findAndGetElement(DCM_PixelData, element).good());
  DcmPixelSequence* fragments = nullptr;
  ASSERT_TRUE(dynamic_cast<DcmPixelData&>(*element)
                  .getEncapsulatedRepresentation(EXS_RLELossless, nullptr, fragments)
                  .good());
  DcmPixelItem* fragment = nullptr;
  ASSERT_TRUE(fragments->getItem(fragment, 1).good());
  Uint8* bytes = nullptr;
  ASSERT_TRUE(fragment->getUint8Array(bytes).good());
  const std::vector<Uint8> whole(bytes, bytes + fragment->getLength());
  const auto reported = [&](const std::vector<Uint8>& changed) {
    EXPECT_TRUE(
        fragment->putUint8Array(changed.data(), static_cast<unsigned long>(changed.size() / 2 * 2)).good());
    EXPECT_TRUE(file.saveFile(files[2].c_str(), EXS_RLELossless).good());
    return finding_ids(read_image_folder(scratch.path()));
  };
  EXPECT_THAT(reported(whole), IsEmpty());
  EXPECT_THAT(reported({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(whole.size() / 2)}),
              ElementsAre("damaged-pixels"));
  std::vector<Uint8> blank = whole;
  std::fill(blank.begin() + static_cast<std::ptrdiff_t>(blank.size() / 2), blank.end(), Uint8{0});
  EXPECT_THAT(reported(blank), ElementsAre("damaged-pixels"));
  std::vector<Uint8> longer = whole;
  longer.insert(longer.end(), {3, 1, 2, 3, 4, 5});
  EXPECT_THAT(reported(longer), ElementsAre("damaged-pixels"));
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("frame 1: the pixels cannot be decoded (RLE Lossless)"));
}

TEST(DamagedImages, BitsLieWhereTheHeaderSays) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  const Image before = read_image_folder(scratch.path()).pixels({0})[0];
  for (const fs::path& path : files) {
    Pixels pixels = pixels_of(path);
    for (Uint16& value : pixels)
      value = static_cast<Uint16>(value << 4U);
    rewrite(path, pixels, [](DcmDataset& data) { data.putAndInsertUint16(DCM_HighBit, 15); });
  }
  EXPECT_TRUE((read_image_folder(scratch.path()).pixels({0})[0] == before).all());
  rewrite(files[0], pixels_of(files[0]), [](DcmDataset& data) { data.putAndInsertUint16(DCM_HighBit, 9); });
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("the highest of 12 bits in 16 cannot be bit 9"));
}

TEST(DamagedImages, WhatIsLeftOfACopyIsToldAndWhatNeverWasAnImageIsNot) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  std::ofstream(scratch.path() / ".keep");
  std::ofstream(scratch.path() / "notes.txt");
  EXPECT_THAT(finding_ids(read_image_folder(scratch.path())), IsEmpty());
  std::ofstream(scratch.path() / "IM000017");
  std::ofstream(scratch.path() / "IM000018") << std::string(100, '\0');
  std::ofstream(scratch.path() / "last.dcm");
  EXPECT_THAT(finding_ids(read_image_folder(scratch.path())),
              ElementsAre("truncated", "truncated", "truncated"));
}

}  // namespace
}  // namespace diastole::imaging
