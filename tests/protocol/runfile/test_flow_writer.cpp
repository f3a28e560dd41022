#include "protocol/runfile/flow_writer.hpp"

#include <gmock/gmock.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/recorded_data.hpp"

namespace diastole::runfile {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class FlowWriter : public testing::Test {
 protected:
  FlowWriter() {
    std::string name = (fs::temp_directory_path() / "diastole-XXXXXX").string();
    folder = ::mkdtemp(name.data());
    run = folder / "a.run.h5";
    fs::copy_file(test::recorded("rig/case-028/baseline.run.h5"), run);
    fs::permissions(run, fs::perms::owner_write, fs::perm_options::add);
  }
  ~FlowWriter() override { fs::remove_all(folder); }
  [[nodiscard]] std::string message(size_t segment, const FlowVolume& given, bool replace) const {
    try {
      store_flow(run, segment, given, replace);
    } catch (const InputError& error) {
      return error.what();
    }
    return "(no error)";
  }
  [[nodiscard]] std::string bytes() const {
    std::ifstream stream(run, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  fs::path folder, run;
  const FlowVolume volume{{0.1, 0.4, 0.9}, {1.0, 12.5, 3.25}, {0.1, 0.2, 0.15}};
};

TEST_F(FlowWriter, WhatIsWrittenIsReadAndAllElseIsAsItWas) {
  const RecordedRun before = read_run(run);
  store_flow(run, 0, volume, true);
  const RecordedRun after = read_run(run);
  EXPECT_EQ(after.flow.at(0).phase_s, volume.phase_s);
  EXPECT_EQ(after.flow.at(0).cavity_mL, volume.cavity_mL);
  EXPECT_EQ(after.flow.at(0).sigma_mL, volume.sigma_mL);
  EXPECT_EQ(after.pressure.time_s, before.pressure.time_s);
  EXPECT_EQ(after.trigger_s, before.trigger_s);
  EXPECT_EQ(after.segments.size(), before.segments.size());
  // Nothing else remains in the folder.
  EXPECT_EQ(std::distance(fs::directory_iterator(folder), fs::directory_iterator()), 1);
}

TEST_F(FlowWriter, AVolumeThatIsThereIsReplacedOnlyIfAsked) {
  store_flow(run, 0, volume, true);
  const std::string kept = bytes();
  EXPECT_THAT(message(0, volume, false), HasSubstr("--force"));
  EXPECT_EQ(bytes(), kept);
  FlowVolume other = volume;
  other.cavity_mL[1] = 13;
  store_flow(run, 0, other, true);
  EXPECT_EQ(read_run(run).flow.at(0).cavity_mL[1], 13);
}

TEST_F(FlowWriter, WhatBreaksARuleChangesNothing) {
  const std::string kept = bytes();
  EXPECT_THAT(message(99, volume, true), HasSubstr("no segment 99"));
  FlowVolume backwards = volume;
  backwards.phase_s = {0.4, 0.1, 0.9};
  EXPECT_THAT(message(0, backwards, true), HasSubstr("/mr/flow/0/phase_s"));
  EXPECT_EQ(bytes(), kept);
}

}  // namespace
}  // namespace diastole::runfile
