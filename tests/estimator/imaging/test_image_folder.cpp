#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "estimator/imaging/series/image_folder.hpp"
#include "estimator/imaging/series/study_skeleton.hpp"
#include "estimator/imaging/series/views.hpp"
#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "tests/estimator/imaging/finding_ids.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole::imaging {
namespace {

using test::finding_ids;
using test::RingScan;
using test::ScratchFolder;
using test::write_ring;
using testing::AllOf;
using testing::Contains;
using testing::DoubleNear;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

TEST(ImageFolder, TellsATaggedCineByItsSpectrum) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  const ImageFolder folder = read_image_folder(scratch.path());
  ASSERT_EQ(folder.series.size(), 1U);
  const ImageSeries& series = folder.series[0];
  EXPECT_EQ(series.kind, SeriesKind::tagged_cine);
  ASSERT_EQ(series.slices.size(), 1U);
  ASSERT_EQ(series.slices[0].tags.size(), 1U);
  EXPECT_NEAR(series.slices[0].tags[0].spacing_mm(), 5.0, 0.01);
  EXPECT_GT(tag_normal(series.plane(), series.slices[0].tags[0]).dot(RingScan().normal()), 0.9999);
  EXPECT_EQ(series.phases.times_ms.size(), 8U);
  EXPECT_TRUE(folder.problems.empty());
}

TEST(ImageFolder, ACineWithoutTagsHasNone) {
  const ScratchFolder scratch;
  write_ring({.tagged = false}, scratch.path());
  EXPECT_EQ(read_image_folder(scratch.path()).series.at(0).kind, SeriesKind::cine);
}

TEST(ImageFolder, NamesAMissingPhaseAndKeepsTheOthersNumbers) {
  const ScratchFolder scratch;
  write_ring({.missing_phase = 4}, scratch.path());
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(folder), testing::ElementsAre("phase-missing"));
  EXPECT_THAT(folder.problems[0].what, HasSubstr("phase 4 of 8"));
  EXPECT_EQ(folder.series[0].phases.index_of(12.0 + 72 * 4), 4U);
  EXPECT_NO_THROW(require_sound(folder));
}

TEST(ImageFolder, RefusesAnExportWithoutTagsInWhichNothingMoves) {
  const ScratchFolder still;
  write_ring({.most_mm2 = 0, .tagged = false}, still.path());
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(still.path())); }),
              HasSubstr("no tags"));
  // A cine of a moving wall shows its outline, and another series may hold what this one lacks.
  const ScratchFolder moving;
  write_ring({.tagged = false}, moving.path());
  EXPECT_NO_THROW(require_sound(read_image_folder(moving.path())));
  write_ring({.series = 3}, still.path(), "tagged");
  EXPECT_NO_THROW(require_sound(read_image_folder(still.path())));
}

TEST(ImageFolder, ASliceBesideTheSpecimenDoesNotHideTheTagsOfTheOthers) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path(), "tagged");
  // Instances bear the same UIDs as the other slice's, which is told: places tell them apart.
  write_ring({.tagged = false, .origin_mm = {-47.5, -47.5, 24}}, scratch.path(), "beside");
  const ImageFolder folder = read_image_folder(scratch.path());
  ASSERT_EQ(folder.series.size(), 1U);
  EXPECT_EQ(folder.series[0].kind, SeriesKind::tagged_cine);
  EXPECT_EQ(folder.series[0].slices[0].tags.size(), 1U);
  EXPECT_TRUE(folder.series[0].slices[1].tags.empty());
  EXPECT_THAT(finding_ids(folder), testing::ElementsAre("instance-twice", "slice-without-tags"));
}

TEST(ImageFolder, AStackIsTheShortAxisWhereverItLies) {
  const Eigen::Vector3d axes[] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int along = 0; along < 3; ++along) {
    // Three places across the axis, and one slice in each of two planes that contain it and cross each other.
    const ScratchFolder scratch;
    const Eigen::Vector3d a = axes[along], b = axes[(along + 1) % 3], c = axes[(along + 2) % 3];
    const auto add = [&](int series, const Eigen::Vector3d& row, const Eigen::Vector3d& column,
                         double at_mm) {
      write_ring({.phases = 2,
                  .series = series,
                  .origin_mm = -47.5 * (row + column) + at_mm * row.cross(column),
                  .along_row = row,
                  .along_column = column},
                 scratch.path(), "series" + std::to_string(series) + "at" + std::to_string(int(at_mm)));
    };
    for (const double at_mm : {0.0, 8.0, 16.0})
      add(2, b, c, at_mm);
    add(3, a, b, 0);
    add(4, a, c, 0);
    const ImageFolder folder = read_image_folder(scratch.path());
    ASSERT_EQ(folder.series.size(), 3U);
    EXPECT_THAT(view_in_words(folder, folder.series[0]), HasSubstr("short axis"));
    EXPECT_THAT(view_in_words(folder, folder.series[1]), HasSubstr("long axis, 0 degrees"));
    EXPECT_THAT(view_in_words(folder, folder.series[2]), HasSubstr("long axis, 90 degrees"));
  }
}

TEST(ImageFolder, RefusesWhatCannotBePutInOrder) {
  const ScratchFolder scratch;
  write_ring({.with_times = false}, scratch.path());
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(test::message_of([&] { require_sound(folder); }), HasSubstr("TriggerTime"));
}

TEST(ImageFolder, RefusesASliceThatIsThereTwiceButNotACopy) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  std::filesystem::copy_file(files[2], scratch.path() / "again.dcm");
  EXPECT_THAT(finding_ids(read_image_folder(scratch.path())), testing::ElementsAre("copy"));
  std::filesystem::copy_file(files[3], scratch.path() / "again too.dcm");
  const ImageFolder copied = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(copied), testing::ElementsAre("copy"));  // all of them at once
  EXPECT_EQ(copied.problems.at(0).number, 2);
  std::filesystem::remove(scratch.path() / "again.dcm");
  std::filesystem::remove(scratch.path() / "again too.dcm");
  write_ring({.phases = 8, .seed = 7}, scratch.path(), "repeated");
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(test::message_of([&] { require_sound(folder); }), HasSubstr("there twice"));
}

TEST(ImageFolder, RefusesTruncatedAndForeignFiles) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  std::filesystem::resize_file(files[5], 9000);
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              testing::AllOf(HasSubstr("im6.dcm"), HasSubstr("ends too early")));
  std::filesystem::remove(files[5]);
  scratch.write("notes.dcm", "slice 3 repeated");
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("notes.dcm"));
  std::filesystem::rename(scratch.path() / "notes.dcm", scratch.path() / "notes.txt");
  EXPECT_NO_THROW(require_sound(read_image_folder(scratch.path())));
}

TEST(ImageFolder, RefusesAFewImagesThatLieOtherwise) {
  const ScratchFolder scratch;
  write_ring({.missing_phase = 6}, scratch.path());
  const auto others = write_ring({.pixel_mm = 1.25}, scratch.path(), "other");
  for (size_t i = 0; i < others.size(); ++i) {
    if (i != 5) std::filesystem::remove(others[i]);
  }
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("another geometry"));
}

/// Seven planes across z and three across x under one series' UID, an image each.
void write_localiser(const std::filesystem::path& folder) {
  RingScan plane{.phases = 1, .tagged = false, .series = 1, .uid = "1.2.4"};
  for (int z = 0; z < 7; ++z) {
    plane.origin_mm = {-47.5, -47.5, 10.0 * z};
    write_ring(plane, folder, fmt::format("across-z{}-", z));
  }
  plane.along_row = {0, 1, 0};
  plane.along_column = {0, 0, -1};
  for (int x = 0; x < 3; ++x) {
    plane.origin_mm = {10.0 * x, -47.5, 47.5};
    write_ring(plane, folder, fmt::format("across-x{}-", x));
  }
}

TEST(ImageFolder, ALocaliserIsNoMixedGeometry) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  write_localiser(scratch.path());
  const ImageFolder folder = read_image_folder(scratch.path());
  EXPECT_THAT(finding_ids(folder), Not(Contains("mixed-geometry")));
  EXPECT_NO_THROW(require_sound(folder));
}

TEST(ImageFolder, TheShortAxisIsThatOfWhatMoves) {
  const ScratchFolder scratch;
  RingScan across{.uid = "1.2.3"};
  across.along_row = {0, 1, 0};
  across.along_column = {0, 0, -1};
  across.origin_mm = {0, -47.5, 47.5};
  for (int slice = 0; slice < 2; ++slice) {
    across.origin_mm.x() = 10.0 * slice;
    write_ring(across, scratch.path(), fmt::format("sa{}-", slice));
  }
  write_ring({.series = 3}, scratch.path(), "la");
  write_localiser(scratch.path());
  const ImageFolder folder = read_image_folder(scratch.path());
  for (const ImageSeries& series : folder.series)
    if (series.number == 2) EXPECT_THAT(view_in_words(folder, series), HasSubstr("short axis"));
}

TEST(ImageFolder, TriggerTimesThatAreNoMillisecondsAreTold) {
  const ScratchFolder scratch;
  RingScan scan;
  scan.first_ms = 0.012;
  scan.step_ms = 0.072;
  write_ring(scan, scratch.path());
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("(0018,1060) goes from 0.012 to 0.516 ms"));
}

TEST(ImageFolder, AFirstPhaseThatIsLateIsTold) {
  const ScratchFolder scratch;
  RingScan scan;
  scan.first_ms = 156;
  write_ring(scan, scratch.path());
  EXPECT_THAT(finding_ids(read_image_folder(scratch.path())), ElementsAre("first-phase-late"));
}

TEST(ImageFolder, FewerPhasesThanTheHeadersAnnounceAreTold) {
  const ScratchFolder scratch;
  for (const auto& path : write_ring({}, scratch.path())) {
    DcmFileFormat file;
    ASSERT_TRUE(file.loadFile(path.c_str()).good());
    ASSERT_TRUE(file.loadAllDataIntoMemory().good());
    ASSERT_TRUE(file.getDataset()->putAndInsertString(DCM_CardiacNumberOfImages, "16").good());
    ASSERT_TRUE(file.saveFile(path.c_str(), EXS_LittleEndianExplicit).good());
  }
  const ImageFolder folder = read_image_folder(scratch.path());
  ASSERT_THAT(finding_ids(folder), ElementsAre("phases-announced"));
  EXPECT_THAT(folder.problems[0].what, HasSubstr("8 phases are here, and (0018,1090) announces 16"));
}

TEST(ImageFolder, TagsThatTheFirstPhaseLacksAreTold) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  write_ring({.phases = 1, .tagged = false}, scratch.path());  // over the first
  EXPECT_THAT(finding_ids(read_image_folder(scratch.path())), ElementsAre("tags-begin-late"));
}

TEST(ImageFolder, RefusesSequencesNestedDeeperThanAnyScannersBeforeTheyAreRead) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(files[0].c_str()).good());
  DcmItem* item = file.getDataset();
  for (int level = 0; level < 100; ++level)
    ASSERT_TRUE(item->findOrCreateSequenceItem(DCM_ReferencedImageSequence, item).good());
  ASSERT_TRUE(item->putAndInsertString(DCM_ImageComments, "deep").good());
  for (const E_TransferSyntax syntax : {EXS_LittleEndianExplicit, EXS_BigEndianExplicit}) {
    for (const E_EncodingType lengths : {EET_UndefinedLength, EET_ExplicitLength}) {
      ASSERT_TRUE(file.saveFile(files[0].c_str(), syntax, lengths).good());
      EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
                  HasSubstr("100 sequences within each other"));
    }
  }
}

TEST(ImageFolder, CountsSequencesWhereverTheyLieInTheFile) {
  const ScratchFolder scratch;
  const auto files = write_ring({.phases = 1}, scratch.path());
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(files[0].c_str()).good());
  ASSERT_TRUE(file.loadAllDataIntoMemory().good());
  DcmItem* item = file.getDataset();
  for (int level = 0; level < 100; ++level)
    ASSERT_TRUE(item->findOrCreateSequenceItem(DCM_ContentSequence, item).good());
  // Files are searched 64 kB at a time: the edge lies at each place of an item's eight bytes once.
  for (size_t before = 64000; before < 64048; before += 2) {
    const std::string comment(before, '-');
    ASSERT_TRUE(file.getDataset()->putAndInsertString(DCM_ImageComments, comment.c_str()).good());
    ASSERT_TRUE(file.saveFile(files[0].c_str(), EXS_LittleEndianExplicit, EET_UndefinedLength).good());
    EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
                HasSubstr("100 sequences within each other"))
        << before;
  }
}

TEST(ImageFolder, RefusesAFileThatIsDeflatedAsAWhole) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(files[0].c_str()).good());
  ASSERT_TRUE(file.saveFile(files[0].c_str(), EXS_DeflatedLittleEndianExplicit).good());
  EXPECT_THAT(test::message_of([&] { require_sound(read_image_folder(scratch.path())); }),
              HasSubstr("deflated as a whole"));
}

TEST(ImageFolder, RefusesACompressionThatIsNotReadBeforeItReadsPixels) {
  const ScratchFolder scratch;
  const auto files = write_ring({}, scratch.path());
  DcmFileFormat file;
  ASSERT_TRUE(file.loadFile(files[0].c_str()).good());
  DJEncoderRegistration::registerCodecs();
  ASSERT_TRUE(file.getDataset()->chooseRepresentation(EXS_JPEGProcess14SV1, nullptr).good());
  ASSERT_TRUE(file.saveFile(files[0].c_str(), EXS_JPEGProcess14SV1).good());
  EXPECT_THAT(finding_ids(read_image_folder(scratch.path())), IsEmpty());
  std::ifstream stream(files[0], std::ios::binary);
  const std::string bytes(std::istreambuf_iterator<char>(stream), {});
  const auto refusal = [&](const std::string& syntax) {
    const std::string lossless = "1.2.840.10008.1.2.4.70";
    std::ofstream(files[0], std::ios::binary)
        << std::string(bytes).replace(bytes.find(lossless), lossless.size(), syntax);
    return test::message_of([&] { require_sound(read_image_folder(scratch.path())); });
  };
  EXPECT_THAT(refusal("1.2.840.10008.1.2.4.90"),
              HasSubstr("compressed in a way that is not read: JPEG 2000 (Lossless only)"));
  EXPECT_THAT(refusal("1.2.840.10008.1.2.4.99"), HasSubstr("1.2.840.10008.1.2.4.99"));
}

TEST(TrackFolder, ReadsThePoseBeforeItTracks) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  std::ofstream(scratch.path() / "mine.pose.toml") << "origin_mm = [0, 0]\n";
  std::vector<std::string> stages;
  EXPECT_THAT(test::message_of([&] {
                (void)track_folder(
                    {.folder = scratch.path(), .pose = {}, .known_pose = {}, .coordinates = "specimen"},
                    [&](const std::string& stage) { stages.push_back(stage); });
              }),
              HasSubstr("origin_mm"));
  EXPECT_THAT(stages, ElementsAre("reading the folder"));
}

TEST(ImageFolder, RefusesAnEmptyFolder) {
  const ScratchFolder scratch;
  EXPECT_THAT(test::message_of([&] { (void)read_image_folder(scratch.path()); }), HasSubstr("no MR images"));
}

TEST(StudySkeleton, IsAHeartsWhereDiffusionWasImagedAndNamesEachSeriesCommand) {
  const ScratchFolder scratch;
  write_ring({}, scratch.path());
  ImageFolder folder = read_image_folder(scratch.path());
  const std::filesystem::path study = scratch.path() / "mine.study.toml";
  EXPECT_THAT(study_skeleton(folder, study),
              AllOf(HasSubstr("kind = \"annulus\""), HasSubstr("images = \".\""), HasSubstr("time_s =")));
  folder.series[0].kind = SeriesKind::diffusion;
  EXPECT_THAT(study_skeleton(folder, study),
              AllOf(HasSubstr("kind = \"fitted-lv\""), HasSubstr("mesh_file = \"mine.mesh\""),
                    HasSubstr("diastole fibres . --study mine.study.toml -o mine.fibres.csv"),
                    HasSubstr("have no tags"), Not(HasSubstr("images = "))));
  folder.series.push_back(read_image_folder(scratch.path()).series[0]);
  EXPECT_THAT(study_skeleton(folder, study),
              AllOf(HasSubstr("kind = \"fitted-lv\""), HasSubstr("[images.to_specimen]")));
  EXPECT_THAT(study_skeleton(folder, scratch.path() / "a\"b.study.toml"),
              HasSubstr(R"(mesh_file = "a\"b.mesh")"));
}

TEST(PhaseTimes, CountsWhatIsMissingBetween) {
  const std::vector<std::vector<double>> times = {{12, 84, 228, 300}, {12.4, 84.3}};
  const PhaseTimes phases = phase_times(times);
  ASSERT_EQ(phases.times_ms.size(), 5U);
  EXPECT_NEAR(phases.times_ms[2], 156, 1);
  EXPECT_FALSE(phases.present[2]);
  EXPECT_EQ(phases.index_of(299), 4U);
  EXPECT_FALSE(phases.index_of(500));
}

TEST(PhaseTimes, AreOneWhereSlicesDifferByLessThanAQuarterOfTheStep) {
  const std::vector<std::vector<double>> times = {
      {20, 168, 316, 464}, {22, 170, 318, 466}, {25, 163, 311, 469}};
  const PhaseTimes phases = phase_times(times);
  EXPECT_THAT(phases.times_ms, ElementsAre(DoubleNear(67.0 / 3, 1e-9), DoubleNear(167, 1e-9),
                                           DoubleNear(315, 1e-9), DoubleNear(1399.0 / 3, 1e-9)));
}

TEST(PhaseTimes, EndWhateverTheTimesAre) {
  const std::vector<std::vector<double>> times = {{-1e308, 0, 1e308}, {1e308}};
  EXPECT_GE(phase_times(times).times_ms.size(), 2U);
}

TEST(TagWaves, TellAGridsTwoDirectionsFromItsSums) {
  Image image(96, 96);
  for (Eigen::Index row = 0; row < 96; ++row) {
    for (Eigen::Index column = 0; column < 96; ++column) {
      const double x = static_cast<double>(column), y = static_cast<double>(row);
      image(row, column) =
          static_cast<float>(1000 * (0.55 - 0.45 * std::cos(1.0 * x)) * (0.55 - 0.45 * std::cos(1.1 * y)));
    }
  }
  SlicePlane plane;
  plane.rows = plane.columns = 96;
  const auto waves = find_tag_waves(image, plane);
  ASSERT_EQ(waves.size(), 2U);
  EXPECT_NEAR(std::max(waves[0].spacing_mm(), waves[1].spacing_mm()), 6.283, 0.02);
  EXPECT_NEAR(std::min(waves[0].spacing_mm(), waves[1].spacing_mm()), 5.712, 0.02);
}

}  // namespace
}  // namespace diastole::imaging
