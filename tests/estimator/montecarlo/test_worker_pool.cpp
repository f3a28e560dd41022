#include "estimator/montecarlo/worker_pool.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <csignal>
#include <map>
#include <numeric>
#include <set>

#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

std::vector<size_t> jobs(size_t count) {
  std::vector<size_t> numbers(count);
  std::iota(numbers.begin(), numbers.end(), 100);
  return numbers;
}

TEST(ForkedPool, DoesEveryJobOnceInOtherProcesses) {
  for (const size_t workers : {1U, 2U, 5U}) {
    std::map<size_t, std::string> results;
    std::set<std::string> processes;
    run_forked(
        jobs(23), workers, [](size_t job) { return fmt::format("{} {}", job * job, ::getpid()); },
        [&](size_t job, const std::string& result) {
          EXPECT_TRUE(results.emplace(job, result.substr(0, result.find(' '))).second);
          processes.insert(result.substr(result.find(' ')));
        });
    EXPECT_EQ(results.size(), 23U);
    for (const auto& [job, result] : results)
      EXPECT_EQ(result, std::to_string(job * job));
    EXPECT_LE(processes.size(), workers);
    EXPECT_EQ(processes.contains(fmt::format(" {}", ::getpid())), workers == 1);
  }
}

TEST(ForkedPool, TakesLongResultsAndFewJobs) {
  size_t length = 0;
  run_forked(
      {7, 8}, 4, [](size_t job) { return std::string(job * 100'000, 'x'); },
      [&](size_t, const std::string& result) { length += result.size(); });
  EXPECT_EQ(length, 1'500'000U);
  run_forked(
      {}, 4, [](size_t) { return ""; }, [](size_t, const std::string&) { FAIL(); });
}

TEST(ForkedPool, AWorkerThatDiesIsAnErrorWithItsJobAndKeepsWhatCame) {
  size_t received = 0;
  try {
    run_forked(
        jobs(10), 2,
        [](size_t job) {
          if (job == 105) ::raise(SIGKILL);
          return std::string("done");
        },
        [&](size_t, const std::string&) { ++received; });
    FAIL() << "no error";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr("job 105"));
  }
  EXPECT_GE(received, 4U);
}

}  // namespace
}  // namespace diastole
