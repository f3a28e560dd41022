// `diastole reference` on a recorded session, and on one that teaches nothing.

#include <gmock/gmock.h>

#include "estimator/explain/rig/reference_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "tests/changed_run.hpp"
#include "tests/estimator/cli/run_command.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::test {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class ReferenceCommand : public testing::Test {
 protected:
  ReferenceCommand() { fs::copy(recorded("rig/case-030"), folder_.path(), fs::copy_options::recursive); }
  [[nodiscard]] fs::path at(const char* name) const { return folder_.path() / name; }
  Outcome learn() {
    testing::internal::CaptureStderr();
    Outcome outcome =
        run_command({"reference", at("case-030.study.toml"), "-o", at("rig.reference.json"), "--json"});
    remarks_ = testing::internal::GetCapturedStderr();
    return outcome;
  }
  std::string remarks_;

 private:
  ScratchFolder folder_;
};

TEST_F(ReferenceCommand, LearnsFromASession) {
  EXPECT_EQ(learn().code, ExitCode::done) << remarks_;
  const fs::path file = at("rig.reference.json");
  const explain::Reference learnt = explain::reference_from_json(read_whole_file(file), file.string());
  EXPECT_TRUE(inference::is_settled(learnt.termination));
}

/// Of a transducer that was not plugged in.
TEST_F(ReferenceCommand, SaysWhenAFitDidNotSettleAndExitsWithOne) {
  change_dataset(at("baseline.run.h5"), "/pressure/cavity_kPa", [](double, size_t) { return 0.0; });
  EXPECT_EQ(learn().code, ExitCode::negative);
  EXPECT_THAT(remarks_, HasSubstr("a session's fit did not settle"));
  EXPECT_THAT(remarks_, HasSubstr("Leave sessions out one by one"));
  EXPECT_FALSE(fs::exists(at("rig.reference.json"))) << "it would hold no numbers";
}

}  // namespace
}  // namespace diastole::test
