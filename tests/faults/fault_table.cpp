#include "tests/faults/fault_table.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

namespace diastole::faults {
namespace {

std::vector<FaultRow>& rows() {
  static std::vector<FaultRow> all;
  return all;
}

class PrintsTheTable final : public testing::Environment {
 public:
  void TearDown() override {
    if (rows().empty()) return;
    fmt::print("\n{:<24}{:>7}{:>10}   {:<40}{}\n", "fault", "tried", "survived", "how", "lost");
    for (const FaultRow& row : rows()) {
      fmt::print("{:<24}{:>7}{:>10}   {:<40}{}\n", row.fault, row.tried, row.survived, row.tried_how,
                 row.lost);
    }
    fmt::print("{}\n", elsewhere);
  }

 private:
  static constexpr const char* elsewhere =
      "Tried elsewhere: a reset in every state of the image (test_sim_board_reset), a power cut at each "
      "single "
      "flash\n"
      "operation (test_sim_board_every_power_cut), damaged frames of every message (fuzz_wire).";
};

/// Whether docs/daemon.md has the row; with the full counts also how often it was tried and survived.
bool is_documented(const FaultRow& row) {
  const bool in_full = trials(0, 1) == 1;
  const std::string counts = fmt::format("| {} | {} |", row.tried, row.survived);
  std::ifstream document(DIASTOLE_SOURCE_DIR "/docs/daemon.md");
  for (std::string line; std::getline(document, line);)
    if (line.starts_with(fmt::format("| {} |", row.fault)) &&
        (!in_full || line.find(counts) != std::string::npos))
      return true;
  return false;
}

const testing::Environment* const registered = testing::AddGlobalTestEnvironment(new PrintsTheTable);

}  // namespace

void add_to_table(const FaultRow& row) {
  rows().push_back(row);
  EXPECT_EQ(row.survived, row.tried) << row.fault;
  EXPECT_TRUE(is_documented(row)) << row.fault << ": docs/daemon.md has no such row, or other counts";
}

int trials(int quick, int full) {
  const char* wanted = std::getenv("DIASTOLE_FAULTS");
  return wanted != nullptr && std::string(wanted) == "full" ? full : quick;
}

int survivors(int tried, const std::function<bool(int, std::mt19937&)>& trial) {
  int survived = 0;
  for (int k = 0; k < tried; ++k) {
    std::mt19937 random(static_cast<unsigned>(k) * 7919U + 17U);
    const bool held = trial(k, random);
    EXPECT_TRUE(held) << "trial " << k;
    survived += held ? 1 : 0;
  }
  return survived;
}

double between(std::mt19937& random, double from, double to) {
  return std::uniform_real_distribution<double>(from, to)(random);
}

}  // namespace diastole::faults
