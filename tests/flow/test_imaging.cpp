// The imaging half by whole programs: what a scanner exported becomes tags, a page and a stiffness; and the page in a real browser.
// Screenshots go to the directory that DIASTOLE_SCREENSHOTS names, if it does.

#include <gmock/gmock.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "tests/flow/browser.hpp"
#include "tests/flow/programs.hpp"
#include "tests/sanitized.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::HasSubstr;

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path, std::ios::binary).rdbuf();
  return text.str();
}

/// The example's gel phantom, C1 = 8.71 kPa.
class ImagedGel : public testing::Test {
 protected:
  ImagedGel() {
    std::filesystem::copy(std::filesystem::path(DIASTOLE_EXAMPLES) / "tagged-gel", place / "gel",
                          std::filesystem::copy_options::recursive);
  }
  Workplace place;
};

TEST_F(ImagedGel, ImagesTellTheirSeries) {
  const Ended images = run(place, {"diastole", "images", "gel/dicom", "--json"});
  ASSERT_EQ(images.exit_code, 0) << images.err;
  const json series = images.json().at("series");
  ASSERT_EQ(series.size(), 4U);
  for (const json& one : series) {
    EXPECT_EQ(one.at("kind"), "tagged cine");
    EXPECT_EQ(one.at("phases"), 8);
    EXPECT_NEAR(one.at("directions")[0].at("spacing_mm").get<double>(), 5, 0.05);
  }
  EXPECT_THAT(series[2].at("orientation").get<std::string>(), HasSubstr("long axis, 20 degrees"));
  EXPECT_TRUE(images.json().at("problems").empty()) << images.out;
}

TEST_F(ImagedGel, OneCommandGoesFromImagesToTheStiffness) {
  if (sanitized) GTEST_SKIP() << "two fits of eight frames: too slow here";
  const Ended fit = run(place, {"diastole", "fit", "gel/tagged-gel.study.toml", "--json", "-o", "fit.json"});
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  const json C1 = fit.json().at("parameters").at("C1_kPa");
  EXPECT_NEAR(C1.at("value").get<double>(), 8.71, 0.01 * 8.71);
  EXPECT_LT(C1.at("ci95")[0].get<double>(), 8.71);
  EXPECT_GT(C1.at("ci95")[1].get<double>(), 8.71);
  EXPECT_NEAR(fit.json().at("chi2_per_dof").get<double>(), 1, 0.1);
  // The second time the tags are there already.
  const Ended again = run(place, {"diastole", "fit", "gel/tagged-gel.study.toml", "--json"});
  EXPECT_THAT(again.err, HasSubstr("Tags of these images are in"));
  EXPECT_EQ(again.json().at("parameters"), fit.json().at("parameters"));

  const Ended report = run(place, {"diastole", "report", "fit.json", "-o", "report.html"});
  ASSERT_EQ(report.exit_code, 0) << report.err;
  const std::string page = text_of(place / "report.html");
  ASSERT_THAT(page, HasSubstr("Images and tags"));
  EXPECT_LT(page.find("Images and tags"), page.find("The stiffness"));
  // One that has lost its images is a report all the same.
  std::filesystem::rename(place / "gel", place / "elsewhere");
  const Ended alone = run(place, {"diastole", "report", "fit.json", "-o", "report.html"});
  EXPECT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_THAT(text_of(place / "report.html"), testing::Not(HasSubstr("Images and tags")));
}

TEST_F(ImagedGel, FilesWhoseNamesAreNoUtf8AreTrackedAndShown) {
  if (sanitized) GTEST_SKIP() << "six series of eight frames: too slow here";
  const std::filesystem::path odd = place /
                                    "gr\xf6\xdf"
                                    "er";
  std::filesystem::copy(place / "gel" / "dicom", odd);
  std::filesystem::rename(odd / "s02_i0001.dcm", odd / "M\xfcller.dcm");
  std::filesystem::remove(odd / "s02_i0004.dcm");
  const Ended track = run(place, {"diastole", "track", odd.string(), "-o", "odd.tags.csv", "--page",
                                  "odd.html", "--record", "odd.json", "--json"});
  ASSERT_EQ(track.exit_code, 0) << track.err;
  EXPECT_THAT(track.json().at("problems").dump(), HasSubstr("M\u{FFFD}ller.dcm"));
  EXPECT_THAT(text_of(place / "odd.json"), HasSubstr("M\u{FFFD}ller.dcm"));
}

TEST_F(ImagedGel, ASliceThatReachesBeyondTheEndIsTold) {
  if (sanitized) GTEST_SKIP() << "ten slices of ten phases: too slow here";
  const Ended scan =
      run(place, {"diastole", "scan", std::string(DIASTOLE_EXAMPLES) + "/phantom-a.study.toml", "-o", "end",
                  "--set", "C1_kPa=8.71", "--matrix", "96", "--snr", "20", "--short-axis=-42,0,42",
                  "--long-axis", "0,90", "--peak-kPa", "3", "--phases", "10"});
  ASSERT_EQ(scan.exit_code, 0) << scan.err;
  const Ended track = run(place, {"diastole", "track", "end/dicom", "-o", "end.tags.csv", "--json"});
  ASSERT_EQ(track.exit_code, 0) << track.err;
  const json problems = track.json().at("problems");
  std::vector<std::string> slices;
  for (const json& problem : problems) {
    if (problem.at("id") == "slice-at-end") slices.push_back(problem.at("where"));
  }
  EXPECT_THAT(slices, testing::ElementsAre("series 2, slice 1", "series 2, slice 3", "series 3, slice 1",
                                           "series 3, slice 3"));
}

TEST_F(ImagedGel, TheSkeletonIsFittedAndReplacedOnlyByForce) {
  if (sanitized) GTEST_SKIP() << "a fit of eight frames: too slow here";
  const std::vector<std::string> command{"diastole", "images", "gel/dicom", "-o", "mine.study.toml"};
  ASSERT_EQ(run(place, command).exit_code, 0);
  std::filesystem::copy(place / "gel" / "tagged-gel.frames.csv", place / "mine.frames.csv");
  const Ended fit = run(place, {"diastole", "fit", "mine.study.toml", "--json"});
  EXPECT_EQ(fit.exit_code, 0) << fit.err;
  EXPECT_NEAR(fit.json().at("parameters").at("C1_kPa").at("value").get<double>(), 8.71, 0.01 * 8.71);
  const Ended again = run(place, command);
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.err, HasSubstr("--force"));
  std::vector<std::string> forced = command;
  forced.emplace_back("--force");
  EXPECT_EQ(run(place, forced).exit_code, 0);
}

TEST_F(ImagedGel, TagsOfAnotherSpacingThanTheStudysAreRefused) {
  place.write("gel/other.study.toml", source_text("examples/tagged-gel/tagged-gel.study.toml") +
                                          "\n[images]\ntag_spacing_mm = 10.0\n");
  const Ended fit = run(place, {"diastole", "fit", "gel/other.study.toml"});
  EXPECT_EQ(fit.exit_code, 2);
  EXPECT_THAT(fit.err, testing::AllOf(HasSubstr("[images] tag_spacing_mm: says 10 mm"),
                                      HasSubstr("have tags every 5.00 mm")));
}

TEST_F(ImagedGel, TwoOutputsOfOneNameAreRefusedBeforeTracking) {
  const Ended track = run(place, {"diastole", "track", "gel/dicom", "-o", "gel.x", "--page", "./gel.x"});
  EXPECT_EQ(track.exit_code, 2);
  EXPECT_THAT(track.err, HasSubstr("another output"));
  EXPECT_FALSE(std::filesystem::exists(place / "gel.x"));
}

TEST_F(ImagedGel, AnImageIsNeverReplaced) {
  const std::string image = "gel/dicom/s02_i0001.dcm";
  const auto size = std::filesystem::file_size(place / image);
  const Ended track = run(place, {"diastole", "track", "gel/dicom", "--force", "-o", image});
  EXPECT_EQ(track.exit_code, 2);
  EXPECT_THAT(track.err, HasSubstr("is an image (DICOM)"));
  EXPECT_EQ(std::filesystem::file_size(place / image), size);
}

TEST_F(ImagedGel, APoseThatIsBrokenIsTold) {
  place.write("gel/tagged-gel.pose.toml", "origin_mm = [0, 0]\n");
  const Ended track = run(place, {"diastole", "track", "gel/dicom", "-o", "gel.tags.csv"});
  EXPECT_EQ(track.exit_code, 2);
  EXPECT_THAT(track.err, HasSubstr("tagged-gel.pose.toml"));
}

TEST_F(ImagedGel, PosesOfWhichNoneIsNamedAndFramesOfOtherPhasesAreTold) {
  if (sanitized) GTEST_SKIP() << "a fit of eight frames: too slow here";
  std::filesystem::copy(place / "gel" / "tagged-gel.pose.toml", place / "gel" / "other.pose.toml");
  std::string frames = source_text("examples/tagged-gel/tagged-gel.frames.csv");
  place.write("gel/tagged-gel.frames.csv", with(frames, "\n1,0.0120,", "\n1,0.1500,"));
  const Ended fit = run(place, {"diastole", "fit", "gel/tagged-gel.study.toml"});
  EXPECT_THAT(fit.err, HasSubstr("2 poses lie here"));
  const auto names_frame_1 = HasSubstr(
      "frame 1 is at 150 ms, and the images' phase 1 at 12 ms: does its pressure belong to phase 2?");
  EXPECT_THAT(fit.err, names_frame_1);
  const Ended again = run(place, {"diastole", "fit", "gel/tagged-gel.study.toml"});
  EXPECT_THAT(again.err, testing::AllOf(HasSubstr("Tags of these images are in"), names_frame_1));
}

TEST_F(ImagedGel, AScanLeavesItsFolderAndNothingElse) {
  std::filesystem::create_directory(place / "trial.partial");
  const std::string study = std::string(DIASTOLE_EXAMPLES) + "/phantom-a.study.toml";
  const std::vector<std::string> scan{
      "diastole",    "scan", study,      "--set", "C1_kPa=8.71", "--matrix", "96", "--short-axis=0",
      "--long-axis", "0",    "--phases", "2",     "--peak-kPa",  "1",        "-o"};
  const auto to = [&](const std::string& folder) {
    std::vector<std::string> command = scan;
    command.push_back(folder);
    return run(place, command);
  };
  const Ended made = to("trial/");
  EXPECT_EQ(made.exit_code, 0) << made.err;
  EXPECT_TRUE(std::filesystem::exists(place / "trial" / "scan.study.toml"));
  EXPECT_TRUE(std::filesystem::exists(place / "trial.partial"));
  const Ended nowhere = to("missing/trial");
  EXPECT_EQ(nowhere.exit_code, 2);
  EXPECT_THAT(nowhere.err, HasSubstr("cannot be made"));
  std::vector<std::string> left;
  for (const auto& entry : std::filesystem::directory_iterator(place.path()))
    if (entry.path().filename().string().starts_with("trial"))
      left.push_back(entry.path().filename().string());
  EXPECT_THAT(left, testing::UnorderedElementsAre("trial", "trial.partial"));
}

TEST_F(ImagedGel, AnInterruptedScanLeavesNothing) {
  Program scan(place, {"diastole", "scan", std::string(DIASTOLE_EXAMPLES) + "/phantom-a.study.toml", "--set",
                       "C1_kPa=8.71", "--matrix", "512", "--phases", "60", "--peak-kPa", "3", "-o", "trial"});
  const auto left = [&] {
    size_t count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(place.path()))
      count += entry.path().filename().string().starts_with("trial") ? 1 : 0;
    return count;
  };
  for (int wait = 0; wait < 600 && left() == 0; ++wait)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  ASSERT_EQ(left(), 1U);
  scan.signal(SIGINT);
  const Ended ended = scan.wait();
  EXPECT_EQ(ended.exit_code, 1);
  EXPECT_THAT(ended.err, HasSubstr("interrupted; nothing was written"));
  EXPECT_EQ(left(), 0U);
}

class TrackingInABrowser : public ImagedGel {
 protected:
  void SetUp() override {
    if (Browser::program().empty())
      GTEST_SKIP() << "this machine has no Chromium: apt install chromium-headless-shell";
  }
};

TEST_F(TrackingInABrowser, ThePagePlaysEverySliceWithItsLines) {
  const Ended tracked =
      run(place, {"diastole", "track", "gel/dicom", "-o", "gel.tags.csv", "--page", "gel.html", "--json"});
  ASSERT_EQ(tracked.exit_code, 0) << tracked.err;
  Browser browser(place, 1280, 1400);
  const std::string url = "file://" + (place / "gel.html").string();
  browser.open(url);
  browser.wait_until("document.querySelectorAll('.cine canvas').length === 4");
  EXPECT_EQ(browser.value("cine.players.length"), 4);
  EXPECT_EQ(browser.value("cine.players[0].slice.images.length"), 8);
  // As many points as the command said, and each lies within its picture.
  EXPECT_EQ(browser.value("cine.players.reduce((sum, p) => sum + p.slice.images.reduce((s, i) => s + "
                          "i.points.length / 5, 0), 0)"),
            tracked.json().at("points"));
  EXPECT_EQ(browser.value("cine.players.every(p => p.slice.images.every(i => i.points.every((v, n) => n % 5 "
                          "< 2 || n % 5 > 3 || (v > 0 && v < 96))))"),
            true);
  const auto picture = [&] { return browser.value("cine.players[0].canvas.toDataURL()").get<std::string>(); };
  const std::string first = picture();
  browser.value("(r => { r.value = 4; r.dispatchEvent(new Event('input')); })(cine.players[0].range)");
  EXPECT_EQ(browser.value("document.querySelector('.cine-time').textContent"), "phase 5, 606 ms");
  const std::string fifth = picture();
  EXPECT_NE(fifth, first);
  // Without its lines the image is grey.
  browser.value("document.getElementById('cine-lines').click()");
  browser.value("document.getElementById('cine-rejected').click()");
  EXPECT_NE(picture(), fifth);
  const std::string grey =
      "(c => { const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
      " for (let i = 0; i < d.length; i += 4) if (d[i] !== d[i + 1] || d[i] !== d[i + 2]) return false; "
      "return true; })(cine.players[0].canvas)";
  EXPECT_EQ(browser.value(grey), true);
  browser.value("document.getElementById('cine-lines').click()");
  EXPECT_EQ(browser.value(grey), false);
  // It plays, and stops.
  browser.value("document.querySelector('.cine-play').click()");
  browser.wait_until("cine.players[0].phase !== 4");
  browser.value("document.querySelector('.cine-play').click()");
  EXPECT_EQ(browser.value("cine.players[0].timer === undefined"), true);
  // A point under the mouse tells its error.
  browser.value(
      "(p => { p.range.value = 4; p.draw(); const b = p.canvas.getBoundingClientRect(), i = p.image.points;"
      " p.canvas.dispatchEvent(new PointerEvent('pointermove', { clientX: b.left + (i[2] + 0.5) / 96 * "
      "b.width, clientY: b.top + (i[3] + 0.5) / 96 * b.height })); })(cine.players[0])");
  EXPECT_THAT(browser.value("document.querySelector('.cine-at').textContent").get<std::string>(),
              HasSubstr("px"));
  if (const char* directory = std::getenv("DIASTOLE_SCREENSHOTS"))
    browser.screenshot(std::string(directory) + "/track.png");
  browser.resize(390, 800);
  EXPECT_EQ(browser.value("document.documentElement.scrollWidth <= 390"), true)
      << "the page is wider than a telephone";
  EXPECT_THAT(browser.complaints(), testing::IsEmpty());
  for (const std::string& asked : browser.requested_urls())
    EXPECT_TRUE(asked == url || asked.starts_with("data:")) << asked;
}

}  // namespace
}  // namespace diastole::flow
