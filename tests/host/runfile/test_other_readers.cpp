// What other people's software makes of our files: the BIDS export, and the example of docs/run-file.md.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "host/runfile/assemble.hpp"
#include "host/runfile/bids_export.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/host/bench/run_in_memory.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/runfile/output_of.hpp"
#include "tests/protocol/signal/filtered_at_once.hpp"

namespace diastole {
namespace {

const std::filesystem::path source_dir = DIASTOLE_SOURCE_DIR;

bool lacks_h5py(const Output& output) {
  return output.text.find("No module named 'h5py'") != std::string::npos;
}

/// A recorded session with a gap of three samples.
runfile::RecordedRun recording_with_a_gap() {
  runfile::RecordedRun run = runfile::read_run(source_dir / "examples/recorded-baseline.run.h5");
  for (size_t i = 4000; i < 4003; ++i)
    for (auto& [name, values] : run.pressure.channels)
      values[i] = std::nan("");
  run.gaps = {{"pressure", 4000, 3, "no answer"}};
  const auto design = filter_of(1.0 / 300);
  run.pressure.channels[runfile::cavity_filtered_channel] =
      signal::filter_zero_phase(run.pressure.channels.at(runfile::cavity_channel), {}, *design);
  run.pressure.notes[runfile::cavity_filtered_channel] = notes_of(*design);
  return run;
}

void write(const std::filesystem::path& file, const std::string& content) {
  std::ofstream(file, std::ios::binary) << content;
}

TEST(BidsExport, IsReadByAnIndependentReader) {
  const Scratch scratch("bids");
  const runfile::RecordedRun run = recording_with_a_gap();
  write_run(scratch / "gel.run.h5", run);
  const runfile::RunFile file = runfile::open_run(scratch / "gel.run.h5");
  const nlohmann::ordered_json description = bids_description(file);
  EXPECT_LT(description.at("StartTime").get<double>(), 0);
  write_bids_table(file, scratch / "gel_physio.tsv.gz");
  write(scratch / "gel_physio.json", description.dump());
  const Output output =
      output_of("/usr/bin/python3 " + (source_dir / "tests/host/runfile/read_bids.py").string() + " " +
                (scratch / "gel.run.h5").string() + " " + (scratch / "gel_physio").string());
  if (lacks_h5py(output)) GTEST_SKIP() << "python3-h5py is absent";
  EXPECT_EQ(output.status, 0) << output.text;
}

TEST(RunFilePage, ItsPythonExampleRuns) {
  std::ifstream stream(source_dir / "docs/run-file.md");
  std::stringstream page;
  page << stream.rdbuf();
  const std::string text = page.str(), fence = "```python\n";
  const size_t begin = text.find(fence);
  ASSERT_NE(begin, std::string::npos);
  const size_t code = begin + fence.size();
  const Scratch scratch("page");
  write(scratch / "example.py", text.substr(code, text.find("```", code) - code));
  write_run(scratch / "gel.run.h5", recording_with_a_gap());
  const Output output = output_of("cd " + scratch.path().string() + " && /usr/bin/python3 example.py");
  if (lacks_h5py(output)) GTEST_SKIP() << "python3-h5py is absent";
  EXPECT_EQ(output.status, 0) << output.text;
  EXPECT_THAT(output.text, testing::HasSubstr("pressure 4000 3 no answer"));
  EXPECT_THAT(output.text, testing::HasSubstr("frame  0"));
}

}  // namespace
}  // namespace diastole
