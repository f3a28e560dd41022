// The catalogue of runs: what it finds in a folder, what it makes of words, and that it follows the files.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/note_writer.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/recorded_data.hpp"
#include "tools/diastole/runs/catalogue.hpp"
#include "tools/diastole/runs/runs_page.hpp"

namespace diastole::catalogue {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

class RunsOfAFolder : public testing::Test {
 protected:
  RunsOfAFolder() {
    copy_run("monday/a.run.h5");
    copy_run("b.run.h5");
  }
  void copy_run(const std::string& name) {
    fs::create_directories((scratch / name).parent_path());
    fs::copy_file(test::recorded("rig/case-028/baseline.run.h5"), scratch / name);
    fs::permissions(scratch / name, fs::perms::owner_write, fs::perm_options::add);
  }
  void write(const std::string& name, const std::string& text) {
    fs::create_directories((scratch / name).parent_path());
    std::ofstream(scratch / name) << text;
  }
  /// An explanation of the study that names monday's run.
  void explain(const std::string& verdict, const std::string& effect) {
    write("monday/a.study.toml", "[data]\nruns = [\"a.run.h5\"]\n");
    write("monday/out/explanation.json",
          "{\"format\": \"diastole-explanation\", \"format_version\": 1, \"study\": \"monday/a.study.toml\", "
          "\"verdict\": \"" +
              verdict + "\", \"effects\": [{\"id\": \"" + effect +
              "\", \"parameters\": {}}], \"shifts\": [{\"name\": \"C1_kPa\", \"before\": 9, "
              "\"before_error\": 0.1, \"after\": "
              "8.5, \"after_error\": 0.2}], \"traces\": [{\"time_s\": [1, 2, 3]}], \"seconds\": 1}");
  }
  Refreshed refresh() {
    return catalogue.refresh([](int64_t, int64_t) {});
  }
  [[nodiscard]] std::vector<std::string> paths(const std::vector<std::string>& words,
                                               const std::string& sort = "path") const {
    std::vector<std::string> found;
    for (const Entry& entry : catalogue.find({condition_of(words), sort, true}).entries)
      found.push_back(entry.path);
    return found;
  }
  Scratch scratch{"catalogue"};
  Catalogue catalogue{scratch.path(), ":memory:"};
};

TEST_F(RunsOfAFolder, ARunIsReadOnceAndAgainWhenItHasChanged) {
  EXPECT_EQ(refresh().read, 2);
  EXPECT_THAT(paths({}), ElementsAre("b.run.h5", "monday/a.run.h5"));
  EXPECT_EQ(refresh().read, 0);
  runfile::append_note(scratch / "b.run.h5", {"2026-11-23T14:00:00Z", "Jo", "a bubble in the hose"});
  const Refreshed again = refresh();
  EXPECT_EQ(again.read, 1);
  EXPECT_EQ(again.removed, 0);
  EXPECT_THAT(paths({"notes=bubble"}), ElementsAre("b.run.h5"));
  EXPECT_THAT(paths({"bubble"}), ElementsAre("b.run.h5"));
  fs::remove(scratch / "b.run.h5");
  EXPECT_EQ(refresh().removed, 1);
  EXPECT_THAT(paths({}), ElementsAre("monday/a.run.h5"));
}

TEST_F(RunsOfAFolder, ARunHasTheVerdictAndTheStiffnessOfItsExplanation) {
  explain("named", "hose-compliance");
  refresh();
  EXPECT_THAT(paths({"verdict=named", "kind=run"}), ElementsAre("monday/a.run.h5"));
  EXPECT_THAT(paths({"effects=hose", "stiffness_kPa<8.6", "kind=run"}), ElementsAre("monday/a.run.h5"));
  EXPECT_THAT(paths({"stiffness_kPa>8.6"}), IsEmpty());
  EXPECT_THAT(paths({"kind=explanation"}), ElementsAre("monday/out/explanation.json"));
  // Another verdict takes the first one's place, and none is left when the explanation is gone.
  explain("unexplained", "backlash");
  refresh();
  EXPECT_THAT(paths({"verdict=unexplained", "kind=run"}), ElementsAre("monday/a.run.h5"));
  fs::remove(scratch / "monday/out/explanation.json");
  refresh();
  EXPECT_THAT(paths({"verdict=unexplained"}), IsEmpty());
}

TEST_F(RunsOfAFolder, WhatCannotBeReadStandsThereWithItsProblem) {
  write("cut.run.h5", std::string(100, 'x'));
  write("cut/explanation.json", "{\"format\": \"diastole-explanation\", \"verdict\": ");
  write("other.json", "{\"some\": \"thing\"}");
  write("images/1.dcm", "x");
  write("images/2.dcm", "y");
  write(".hidden/c.run.h5", "x");
  refresh();
  EXPECT_THAT(paths({"sound=no"}), ElementsAre("cut.run.h5"));
  EXPECT_THAT(paths({"problem=HDF5"}), ElementsAre("cut.run.h5"));
  EXPECT_THAT(paths({"kind=images"}), ElementsAre("images"));
  EXPECT_THAT(paths({"kind=explanation"}), ElementsAre("cut/explanation.json"));
  EXPECT_THAT(paths({}), SizeIs(5));
}

TEST_F(RunsOfAFolder, ACrateIsLeftOutUnlessItIsAskedItself) {
  copy_run("out/crate/b.run.h5");
  write("out/crate/ro-crate-metadata.json", "{}");
  refresh();
  EXPECT_THAT(paths({}), ElementsAre("b.run.h5", "monday/a.run.h5"));
  Catalogue of_crate(scratch / "out/crate", ":memory:");
  of_crate.refresh([](int64_t, int64_t) {});
  EXPECT_EQ(of_crate.find({condition_of({})}).matched, 1);
}

TEST_F(RunsOfAFolder, WordsThatStandNowhereAreNamed) {
  refresh();
  EXPECT_THAT(catalogue.found_nowhere({"nosuch", "monday", "specimen=gel", "mond*"}), ElementsAre("nosuch"));
}

TEST_F(RunsOfAFolder, TextsNumbersAndDatesAreFiltered) {
  refresh();
  const Entry entry = catalogue.find({condition_of({"path=b.run"}), "date", true}).entries.front();
  EXPECT_EQ(entry.sound, true);
  EXPECT_GT(entry.peak_kPa.value(), 1);
  EXPECT_THAT(entry.trace, SizeIs(2 * 96));
  EXPECT_THAT(paths({"since=" + entry.date.substr(0, 7), "until=" + entry.date.substr(0, 7)}), SizeIs(2));
  EXPECT_THAT(paths({"since=2999"}), IsEmpty());
  EXPECT_THAT(paths({"until=1999"}), IsEmpty());
  EXPECT_THAT(paths({"kind=RUN"}), SizeIs(2));
  EXPECT_THAT(paths({"kind!=run"}), IsEmpty());
  EXPECT_THAT(paths({"kind=r*n"}), SizeIs(2));
  EXPECT_THAT(paths({"path=%"}), IsEmpty()) << "a letter like any other";
  EXPECT_THAT(paths({"cycles>=1", "peak_kPa<1000", "sound=yes"}), SizeIs(2));
}

TEST(RunFilter, WhatItDoesNotKnowIsRefusedWithTheNearest) {
  const auto message = [](const std::string& word) {
    try {
      (void)condition_of({word});
    } catch (const InputError& error) {
      return std::string(error.what());
    }
    return std::string("(no error)");
  };
  EXPECT_THAT(message("specimn=gel"), HasSubstr("specimen"));
  EXPECT_THAT(message("cycles=many"), HasSubstr("no number"));
  EXPECT_THAT(message("specimen<gel"), HasSubstr("is a text"));
  EXPECT_THAT(message("sound=maybe"), HasSubstr("yes or"));
  EXPECT_THAT(message("since=monday"), HasSubstr("no date"));
}

TEST_F(RunsOfAFolder, AnIndexThatIsDamagedIsMadeAnew) {
  const Scratch other("catalogue-index");
  std::ofstream(other / "index.sqlite") << "no database at all, but long enough to be looked at as one";
  Catalogue damaged(scratch.path(), other / "index.sqlite");
  EXPECT_EQ(damaged.refresh([](int64_t, int64_t) {}).read, 2);
}

TEST_F(RunsOfAFolder, ThePageShowsEachRunWithItsTraceAndEscapesWhatItSays) {
  runfile::append_note(scratch / "b.run.h5", {"", "", "x"});
  refresh();
  const Found found = catalogue.find({condition_of({}), "date", false});
  const std::string page = runs_page("<folder>", "specimen=<b>", found);
  EXPECT_THAT(page, HasSubstr("monday/a.run.h5"));
  EXPECT_THAT(page, HasSubstr("<path d=\"M"));
  EXPECT_THAT(page, testing::Not(HasSubstr("<folder>")));
}

}  // namespace
}  // namespace diastole::catalogue
