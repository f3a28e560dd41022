// The command itself: its processes, its MPI ranks, its file of cells.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>
#include <filesystem>

#include "estimator/io/whole_file.hpp"
#include "tests/flow/programs.hpp"
#include "tests/sanitized.hpp"

namespace diastole {
namespace {

using testing::HasSubstr;

const std::string command = fmt::format(
    "montecarlo {}/examples/phantom-a-points.study.toml --mesh 4,2,1 --set C1_kPa=8.7 --noise 0.8,3.2 "
    "--frames 1,5 "
    "--repeats 2 --json --cells cells.csv",
    DIASTOLE_SOURCE_DIR);

/// Rows without the seconds, sorted: ranks and workers end in any order.
std::vector<std::string> rows_of(const std::filesystem::path& path) {
  std::vector<std::string> rows;
  std::string text = read_whole_file(path);
  for (size_t end = text.find('\n'); end != std::string::npos; end = text.find('\n')) {
    const std::string row = text.substr(0, end);
    text.erase(0, end + 1);
    if (row.find("_") != std::string::npos) {  // what was asked, and the header
      rows.push_back(row);
      continue;
    }
    const size_t error = row.rfind(','), value = row.rfind(',', error - 1);
    const size_t seconds = row.rfind(',', value - 1);
    rows.push_back(row.substr(0, seconds) + row.substr(value, 6));
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

TEST(MonteCarloCommand, GivesTheSameTableInOneProcessInTwoAndWhenItGoesOn) {
  const flow::Workplace place;
  const flow::Ended one = flow::run_line(place, "diastole " + command + " --workers 1");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  const auto json = one.json();
  ASSERT_EQ(json.at("cells").size(), 4U);
  for (const auto& cell : json.at("cells")) {
    EXPECT_EQ(cell.at("refits"), 2);
    for (const char* key : {"mean", "sd", "ci95", "sd_percent", "coverage"})
      EXPECT_TRUE(cell.at("parameters").at("C1_kPa").contains(key)) << key;
  }
  EXPECT_NEAR(json.at("parameters").at("C1_kPa").at("mean").get<double>(), 8.7, 0.5);
  const std::vector<std::string> rows = rows_of(place / "cells.csv");
  EXPECT_EQ(rows.size(), 2U + 12U);  // 2 repeats and one without noise of 4 entries

  // Cut off in its fifth row: four refits are missing, and only they are done.
  const std::string text = read_whole_file(place / "cells.csv");
  size_t cut = 0;
  for (int line = 0; line < 6; ++line)
    cut = text.find('\n', cut) + 1;
  write_whole_file(place / "cells.csv", text.substr(0, cut + 5));
  const flow::Ended two = flow::run_line(place, "diastole " + command + " --workers 2");
  ASSERT_EQ(two.exit_code, 0) << two.err;
  EXPECT_THAT(two.err, HasSubstr("8 refits"));
  EXPECT_EQ(rows_of(place / "cells.csv"), rows);
}

TEST(MonteCarloCommand, GivesTheSameTableOverTwoMpiRanks) {
  if (!std::filesystem::exists(MPIRUN)) GTEST_SKIP() << "skipped: there is no mpirun (package openmpi-bin)";
  if (sanitized) GTEST_SKIP() << "skipped: Open MPI's own leaks hide ours";
  const flow::Workplace place;
  const flow::Ended ranks = flow::run_line(
      place, std::string(MPIRUN) +
                 " --allow-run-as-root --oversubscribe --mca btl self,vader -n 2 diastole " + command);
  ASSERT_EQ(ranks.exit_code, 0) << ranks.err;
  EXPECT_THAT(ranks.err, HasSubstr("2 MPI ranks"));
  EXPECT_EQ(ranks.json().at("processes"), 2);
  const std::vector<std::string> rows = rows_of(place / "cells.csv");
  std::filesystem::remove(place / "cells.csv");
  const flow::Ended one = flow::run_line(place, "diastole " + command + " --workers 1");
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_EQ(rows_of(place / "cells.csv"), rows);
}

TEST(MonteCarloCommand, RefusesANoiseThatIsNoNumber) {
  const flow::Workplace place;
  const flow::Ended ended = flow::run_line(
      place,
      fmt::format("diastole montecarlo {}/examples/phantom-a-points.study.toml --set C1_kPa=8.7 --noise nan",
                  DIASTOLE_SOURCE_DIR));
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.err, HasSubstr("--noise"));
}

}  // namespace
}  // namespace diastole
