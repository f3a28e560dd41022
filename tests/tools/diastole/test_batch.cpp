// Batches whose jobs a script plays, so that how they end is known.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <atomic>
#include <cstdlib>
#include <thread>

#include "estimator/io/whole_file.hpp"
#include "tests/estimator/io/scratch_file.hpp"
#include "tools/diastole/batch/batch_run.hpp"

namespace diastole::batch {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

/// What a job does stands in its input: `done`, `negative`, `refused`, `failed`, `slow`, or `where` it runs. Each start leaves a line in
/// `starts`.
constexpr const char* player = R"script(#!/bin/bash
echo "$1 $2 $(nproc)" >> "$(dirname "$0")/starts"
case $(cat "$2") in
  done) echo '{"parameters": {"C1_kPa": {"value": 8.57, "se": 0.081}}, "verdict": "named", "effects": [{"id": "backlash"}]}' ;;
  negative) echo '{"verdict": "unexplained", "effects": []}'; exit 1 ;;
  refused) echo "the data cannot be what they say" >&2; exit 1 ;;
  failed) echo "progress" >&2; echo "gel.csv: line 3: wrong" >&2; echo "  Mend it." >&2; exit 2 ;;
  slow) exec sleep 60 ;;
  where) pwd -P ;;
esac
)script";

class Batches : public testing::Test {
 protected:
  Batches() {
    folder_.write("player", player);
    fs::permissions(folder_.path() / "player", fs::perms::owner_all);
  }
  Batch batch(const std::string& jobs) {
    return read_batch(folder_.write(
        "gels.batch.toml", "format = \"diastole-batch\"\nversion = 1\noutput = \"results\"\n" + jobs));
  }
  RunOptions options(size_t at_once = 2) { return {(folder_.path() / "player").string(), at_once}; }
  size_t starts() {
    const fs::path file = folder_.path() / "starts";
    if (!fs::exists(file)) return 0;
    const std::string text = read_whole_file(file);
    return static_cast<size_t>(std::ranges::count(text, '\n'));
  }
  std::string refused(const std::string& jobs) {
    return test::message_of([&] { (void)batch(jobs); });
  }
  test::ScratchFolder folder_;
};

TEST_F(Batches, EachCommandOnEachInput) {
  folder_.write("a.study.toml", "done");
  folder_.write("b.study.toml", "done");
  const Batch read = batch(
      "[[job]]\ncommand = \"fit\"\ninputs = [\"*.study.toml\", \"a.study.toml\"]\narguments = [\"--mesh\", "
      "\"4,2,1\"]\n"
      "[[job]]\ncommand = \"explain\"\ninputs = [\"b.study.toml\"]\n");
  std::vector<std::string> names;
  for (const Job& job : read.jobs)
    names.push_back(job.name);
  EXPECT_THAT(names, ElementsAre("fit-a", "fit-b", "fit-a-2", "explain-b"));
  const std::string b = (folder_.path() / "b.study.toml").string();
  EXPECT_THAT(read.jobs[1].arguments, ElementsAre("fit", b, "--mesh", "4,2,1", "--json"));
  EXPECT_THAT(read.jobs[3].arguments,
              ElementsAre("explain", b, "-o", (folder_.path() / "results/explain-b").string(), "--json"));
}

TEST_F(Batches, RefusesWithPlaceAndRemedy) {
  folder_.write("a.study.toml", "done");
  EXPECT_THAT(refused(""), HasSubstr("there is no job"));
  EXPECT_THAT(refused("[[job]]\ncommand = \"fitt\"\ninputs = [\"a.study.toml\"]\n"), HasSubstr("fit"));
  EXPECT_THAT(refused("[[job]]\ncommand = \"fit\"\ninputs = [\"c*.study.toml\"]\n"),
              AllOf(HasSubstr("job[0].inputs"), HasSubstr("nothing is like \"c*.study.toml\"")));
  EXPECT_THAT(
      refused("[[job]]\ncommand = \"fit\"\ninputs = [\"a.study.toml\"]\narguments = [\"-o\", \"x\"]\n"),
      HasSubstr("\"-o\" is set by the batch"));
  EXPECT_THAT(refused("[[job]]\ncommand = \"fit\"\ninput = [\"a.study.toml\"]\n"), HasSubstr("inputs"));
}

TEST_F(Batches, RefusesArgumentsThatWouldGoElsewhereOrDoSomethingElse) {
  folder_.write("a.study.toml", "done");
  folder_.write("b.study.toml", "done");
  const auto with = [](const char* argument, const char* inputs = "a.study.toml") {
    return fmt::format("[[job]]\ncommand = \"fit\"\ninputs = [\"{}\"]\narguments = [\"{}\"]\n", inputs,
                       argument);
  };
  for (const char* set : {"-o", "-ox.fit.json", "--output=x", "--json"})
    EXPECT_THAT(refused(with(set)), HasSubstr(fmt::format("\"{}\" is set by the batch", set)));
  for (const char* help : {"-h", "-hx", "--help"})
    EXPECT_THAT(refused(with(help)), HasSubstr("only prints help"));
  for (const char* file : {"--checkpoint", "--page=x.html"})
    EXPECT_THAT(refused(with(file, "*.study.toml")), HasSubstr("would be one file of 2 jobs"));
  EXPECT_EQ(batch(with("--checkpoint")).jobs.size(), 1U) << "of one job it is that job's";
  EXPECT_EQ(batch(with("-20")).jobs.size(), 1U);
}

/// Whatever folder the batch is started in, also by Slurm.
TEST_F(Batches, FilesInArgumentsCountFromTheBatchFile) {
  folder_.write("a.study.toml", "where");
  const Batch jobs = batch("[[job]]\ncommand = \"fit\"\ninputs = [\"a.study.toml\"]\n");
  (void)run_batch(jobs, options());
  EXPECT_THAT(read_whole_file(jobs.output / "fit-a.json"),
              HasSubstr(fs::canonical(folder_.path()).string() + "\n"));
}

TEST_F(Batches, SaysHowEachJobEndedAndRunsOnlyWhatFailedAgain) {
  folder_.write("good.study.toml", "done");
  folder_.write("poor.study.toml", "negative");
  folder_.write("wrong.study.toml", "failed");
  const Batch jobs = batch(
      "[[job]]\ncommand = \"fit\"\ninputs = [\"good.study.toml\", \"wrong.study.toml\"]\n"
      "[[job]]\ncommand = \"explain\"\ninputs = [\"good.study.toml\", \"poor.study.toml\"]\n");
  const auto first = run_batch(jobs, options());
  EXPECT_EQ(first[0].state, JobState::done);
  EXPECT_EQ(first[0].result, "C1_kPa 8.57 \u00b1 0.081");
  EXPECT_EQ(first[1].state, JobState::failed);
  EXPECT_EQ(first[1].exit_code, 2);
  EXPECT_EQ(first[1].message, "gel.csv: line 3: wrong\n  Mend it.");
  EXPECT_EQ(first[2].result, "named: backlash");
  EXPECT_EQ(first[3].state, JobState::negative);
  EXPECT_TRUE(fs::exists(jobs.output / "fit-good.json"));
  EXPECT_FALSE(fs::exists(jobs.output / "fit-wrong.json"));
  EXPECT_FALSE(fs::exists(jobs.output / "fit-wrong.json.part"));
  EXPECT_EQ(starts(), 4U);

  folder_.write("wrong.study.toml", "done");
  const auto second = run_batch(jobs, options());
  EXPECT_EQ(starts(), 5U);
  EXPECT_EQ(second[1].state, JobState::done);
  EXPECT_EQ(second[0].result, first[0].result);
  // An input that has changed since counts as another one; so does another command line.
  fs::last_write_time(folder_.path() / "good.study.toml",
                      fs::file_time_type::clock::now() + std::chrono::seconds(5));
  (void)run_batch(jobs, options());
  EXPECT_EQ(starts(), 7U);
}

TEST_F(Batches, ExitCode1WithoutADocumentIsNoAnswer) {
  folder_.write("a.study.toml", "refused");
  const Batch jobs = batch("[[job]]\ncommand = \"explain\"\ninputs = [\"a.study.toml\"]\n");
  const JobEnd end = run_batch(jobs, options())[0];
  EXPECT_EQ(end.state, JobState::failed);
  EXPECT_EQ(end.exit_code, 1);
  EXPECT_EQ(end.message, "the data cannot be what they say");
  EXPECT_FALSE(fs::exists(jobs.output / "explain-a.json"));
  EXPECT_EQ(remembered(jobs, jobs.jobs[0]).state, JobState::failed);
}

TEST_F(Batches, JobsAtOnceHaveOneProcessorEach) {
  folder_.write("a.study.toml", "done");
  folder_.write("b.study.toml", "done");
  const Batch jobs = batch("[[job]]\ncommand = \"fit\"\ninputs = [\"*.study.toml\"]\n");
  (void)run_batch(jobs, options(2));
  EXPECT_THAT(read_whole_file(folder_.path() / "starts"),
              AllOf(HasSubstr("a.study.toml 1\n"), HasSubstr("b.study.toml 1\n")));
}

TEST_F(Batches, StopsOnRequestAndGoesOn) {
  folder_.write("a.study.toml", "slow");
  folder_.write("b.study.toml", "slow");
  const Batch jobs = batch("[[job]]\ncommand = \"fit\"\ninputs = [\"*.study.toml\"]\n");
  std::atomic<bool> stop{false};
  RunOptions how = options(1);
  how.interrupted = [&] { return stop.load(); };
  how.on_change = [&](const std::vector<JobEnd>&, size_t running) { stop = stop || running == 1; };
  for (const JobEnd& end : run_batch(jobs, how))
    EXPECT_EQ(end.state, JobState::waiting);
  EXPECT_LE(starts(), 1U);  // it may have been ended before it got so far
  folder_.write("a.study.toml", "done");
  folder_.write("b.study.toml", "done");
  for (const JobEnd& end : run_batch(jobs, options()))
    EXPECT_EQ(end.state, JobState::done);
}

TEST_F(Batches, AProgramThatIsNotThereFailsItsJobs) {
  folder_.write("a.study.toml", "done");
  RunOptions how = options();
  how.program = (folder_.path() / "nothing").string();
  const auto ends = run_batch(batch("[[job]]\ncommand = \"fit\"\ninputs = [\"a.study.toml\"]\n"), how);
  EXPECT_EQ(ends[0].state, JobState::failed);
  EXPECT_EQ(ends[0].exit_code, 127);
}

/// The script runs each task as Slurm would, with a front door that notes how it was called.
TEST_F(Batches, TheSlurmScriptRunsEachJobByItsNumber) {
  folder_.write("a.study.toml", "done");
  folder_.write("b.study.toml", "done");
  const fs::path place = folder_.path() / "it's here";
  fs::create_directory(place);
  const fs::path program = place / "program";
  std::ofstream(program) << "#!/bin/bash\necho \"$*\" >> \"$(dirname \"$0\")/called\"\n";
  fs::permissions(program, fs::perms::owner_all);
  const Batch jobs = batch("[[job]]\ncommand = \"fit\"\ninputs = [\"*.study.toml\"]\n");
  const fs::path script = folder_.write("gels.sh", slurm_script(jobs, program.string()));
  EXPECT_THAT(read_whole_file(script), HasSubstr("#SBATCH --array=1-2\n"));
  for (const char* task : {"1", "2"})
    EXPECT_EQ(std::system(fmt::format("SLURM_ARRAY_TASK_ID={} bash '{}'", task, script.string()).c_str()), 0);
  const std::string file = jobs.file.string();
  EXPECT_EQ(read_whole_file(place / "called"), fmt::format("batch {0} --only 1\nbatch {0} --only 2\n", file));
}

TEST_F(Batches, TheSlurmScriptPassesShellcheck) {
  if (std::system("command -v shellcheck > /dev/null") != 0) GTEST_SKIP() << "shellcheck is not installed";
  folder_.write("a.study.toml", "done");
  const fs::path script = folder_.write(
      "gels.sh",
      slurm_script(batch("[[job]]\ncommand = \"fit\"\ninputs = [\"a.study.toml\"]\n"), "/usr/bin/diastole"));
  EXPECT_EQ(std::system(fmt::format("shellcheck '{}'", script.string()).c_str()), 0);
}

TEST_F(Batches, TwoAtTheSameTimeAreRefusedButForSingleJobs) {
  folder_.write("a.study.toml", "slow");
  folder_.write("b.study.toml", "slow");
  const Batch jobs = batch("[[job]]\ncommand = \"fit\"\ninputs = [\"*.study.toml\"]\n");
  const auto while_running = [&](std::optional<size_t> only, const std::function<void()>& act) {
    std::atomic<bool> stop{false};
    RunOptions how = options(1);
    how.only = only;
    how.interrupted = [&] { return stop.load(); };
    how.on_change = [&](const std::vector<JobEnd>&, size_t running) {
      if (running == 1 && !stop.exchange(true)) act();
    };
    (void)run_batch(jobs, how);
  };
  RunOptions first = options(), stopped = options();
  first.only = 0;
  first.interrupted = [] { return true; };
  stopped.interrupted = first.interrupted;
  const auto refusal_of = [&](const RunOptions& how) {
    return test::message_of([&] { (void)run_batch(jobs, how); });
  };
  while_running({}, [&] {
    EXPECT_THAT(refusal_of(stopped), HasSubstr("another `diastole batch` works on it"));
    EXPECT_THAT(refusal_of(first), HasSubstr("another `diastole batch` works on it"));
  });
  while_running(1, [&] {
    EXPECT_THAT(refusal_of(stopped), HasSubstr("another `diastole batch` works on it"));
    EXPECT_NO_THROW((void)run_batch(jobs, first));
  });
}

TEST_F(Batches, OneJobAlone) {
  folder_.write("a.study.toml", "done");
  folder_.write("b.study.toml", "done");
  RunOptions how = options();
  how.only = 1;
  const auto ends = run_batch(batch("[[job]]\ncommand = \"fit\"\ninputs = [\"*.study.toml\"]\n"), how);
  EXPECT_EQ(ends[0].state, JobState::waiting);
  EXPECT_EQ(ends[1].state, JobState::done);
}

}  // namespace
}  // namespace diastole::batch
