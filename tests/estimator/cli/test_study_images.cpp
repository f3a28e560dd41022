#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <vector>

#include "estimator/cli/study_images.hpp"
#include "estimator/io/tracking_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "tests/estimator/imaging/tagged_ring.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;

/// A study of tagged images of a ring: 16 files, a second to track.
class StudyImages : public testing::Test {
 protected:
  StudyImages() {
    fs::create_directory(folder());
    files_ = test::write_ring({}, folder());
    study_.file = scratch_.path() / "ring.study.toml";
    study_.data.images = folder();
    study_.data.to_specimen = StudyPose{{0, 0, 12}, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}};
  }

  fs::path folder() const { return scratch_.path() / "dicom"; }
  /// The tags that the study is given; the study itself is as before.
  fs::path tags() const {
    Study study = study_;
    use_images(study);
    return *study.data.tags;
  }
  size_t tracked() const {
    return static_cast<size_t>(
        std::count_if(fs::directory_iterator(scratch_.path()), fs::directory_iterator(),
                      [](const auto& entry) { return entry.path().string().ends_with(".tags.csv"); }));
  }

  test::ScratchFolder scratch_;
  std::vector<fs::path> files_;
  Study study_{};
};

TEST_F(StudyImages, AreTrackedOnceForTheSameImages) {
  const fs::path first = tags();
  EXPECT_EQ(first.parent_path(), scratch_.path());
  EXPECT_THAT(first.filename().string(), testing::MatchesRegex("ring\\.images-[0-9a-f]+\\.tags\\.csv"));
  // A hit reads what is there, whatever it holds, and writes nothing.
  { std::ofstream(first, std::ios::app) << "# seen\n"; }
  const auto written = fs::last_write_time(first);
  fs::rename(files_[3], folder() / "another name.dcm");
  fs::rename(folder() / "another name.dcm", files_[3]);
  EXPECT_EQ(tags(), first);
  EXPECT_EQ(fs::last_write_time(first), written);
  EXPECT_EQ(tracked(), 1U);
}

TEST_F(StudyImages, AreKeptWithWhatAReportShowsOfThem) {
  const auto record = [&] {
    Study study = study_;
    return use_images(study).value();
  };
  const fs::path kept = record();
  EXPECT_EQ(tracking_record_from_json(read_whole_file(kept), kept.string()).slices.size(), 1U);
  fs::remove(kept);
  EXPECT_EQ(record(), kept);
  EXPECT_TRUE(fs::is_regular_file(kept));
}

TEST_F(StudyImages, AreTrackedAnewForOtherImagesOrAnotherPose) {
  const fs::path first = tags();
  study_.data.to_specimen->origin_mm[2] += 1;
  const fs::path moved = tags();
  EXPECT_NE(moved, first);
  test::write_ring({.seed = 2}, folder());
  const fs::path other = tags();
  EXPECT_NE(other, moved);
  EXPECT_EQ(tracked(), 3U);
}

TEST_F(StudyImages, AreTrackedAnewForOtherManualChoices) {
  const fs::path first = tags();
  const auto choice = [&](const std::string& phase) {
    scratch_.write("dicom.edits.jsonl", R"({"slice": "series 2, slice 1", "phase": )" + phase +
                                            R"(, "action": "mask", "points": [[60, 60], [95, 60], [95, 95]]})"
                                            "\n");
    return tags();
  };
  const fs::path masked = choice("3");
  EXPECT_NE(masked, first);
  EXPECT_NE(choice("4"), masked);
  EXPECT_EQ(choice("3"), masked);
  EXPECT_EQ(tracked(), 3U);
}

TEST_F(StudyImages, AFolderThatIsNotThereIsRefusedBeforeAnythingIsWritten) {
  study_.data.images = scratch_.path() / "no such folder";
  EXPECT_THAT(test::message_of([&] { (void)tags(); }), testing::HasSubstr("no such folder"));
  EXPECT_EQ(tracked(), 0U);
}

}  // namespace
}  // namespace diastole
