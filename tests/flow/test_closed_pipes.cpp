// Readers that go away and disks that are full, at either output of a program.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>

#include "tests/flow/programs.hpp"

namespace diastole::flow {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

TEST(ClosedPipe, ASimulationWhoseProgressNobodyReadsIsCarriedThrough) {
  const Workplace place;
  place.write("gel.toml", source_text("examples/gel.experiment.toml"));
  const Ended ended =
      run_line(place, "diastole simulate gel.toml -o gel.run.h5 2>&1 >told | true; exit ${PIPESTATUS[0]}");
  EXPECT_EQ(ended.exit_code, 0) << ended.err;
  EXPECT_EQ(run(place, {"diastole", "inspect", "gel.run.h5"}).exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_empty(place.temporary()));
}

TEST(ClosedPipe, AProgramWhoseAnswerNobodyReadsEndsQuietly) {
  const Workplace place;
  place.write("baseline.run.h5", source_text("examples/recorded-baseline.run.h5"));
  for (const char* as_json : {"", " --json"}) {
    const Ended ended = run_line(
        place, std::string("diastole inspect baseline.run.h5") + as_json + " | true; exit ${PIPESTATUS[0]}");
    EXPECT_EQ(ended.exit_code, 128 + SIGPIPE);
    EXPECT_THAT(ended.err, IsEmpty());
  }
}

TEST(FullDisk, AnAnswerThatWasNotWrittenIsAnError) {
  const Workplace place;
  place.write("baseline.run.h5", source_text("examples/recorded-baseline.run.h5"));
  for (const char* as_json : {"", " --json"}) {
    const Ended ended =
        run_line(place, std::string("diastole inspect baseline.run.h5") + as_json + " >/dev/full");
    EXPECT_EQ(ended.exit_code, 2);
    EXPECT_THAT(ended.err, HasSubstr("standard output cannot be written"));
  }
}

TEST(FullDisk, AnExportThatDoesNotFitLeavesNoFolder) {
  const Workplace place;
  place.write("baseline.run.h5", source_text("examples/recorded-baseline.run.h5"));
  for (const char* into : {"--ro-crate new/crate", "--bids new/bids --ro-crate new/crate"}) {
    const Ended ended =
        run_line(place, std::string("trap '' XFSZ; ulimit -f 1; diastole export baseline.run.h5 ") + into);
    EXPECT_EQ(ended.exit_code, 3);
    EXPECT_THAT(ended.err, HasSubstr("new/"));
    EXPECT_FALSE(std::filesystem::exists(place / "new"));
  }
}

}  // namespace
}  // namespace diastole::flow
