#include "host/rig/remark_log.hpp"

#include <gmock/gmock.h>

#include <vector>

namespace diastole {
namespace {

using testing::ElementsAre;

std::vector<std::string> texts(const RemarkLog::Page& page) {
  std::vector<std::string> all;
  for (const auto& remark : page.remarks)
    all.push_back(remark.remark.text);
  return all;
}

TEST(RemarkLog, NumbersStayWhateverIsForgotten) {
  RemarkLog log(3);
  for (const char* text : {"a", "b", "c", "d", "e"})
    log.add({"warning", "gaps", text}, "now");
  EXPECT_THAT(texts(log.from(0, 10)), ElementsAre("c", "d", "e"));
  EXPECT_EQ(log.from(0, 10).remarks[0].number, 2U);
  EXPECT_THAT(texts(log.from(4, 10)), ElementsAre("e"));
  EXPECT_EQ(log.from(0, 2).next, 4U);
  EXPECT_EQ(log.from(4, 10).next, 5U);
  EXPECT_TRUE(log.from(5, 10).remarks.empty());
}

TEST(RemarkLog, AnErrorAfterAndAPromptBeforeAFloodAreThere) {
  RemarkLog log(100);
  log.add({"info", "prompt", "Set slice"}, "now");
  for (int i = 0; i < 100'000; ++i)
    log.add({"warning", "gaps", "37 gaps"}, "now");
  log.add({"error", "estop", "emergency stop"}, "now");
  const RemarkLog::Page page = log.from(0, 1000);
  ASSERT_EQ(page.remarks.size(), 100U);
  EXPECT_EQ(page.remarks[0].remark.code, "prompt");
  EXPECT_EQ(page.remarks[99].remark.text, "emergency stop");
  EXPECT_EQ(page.next, 100'002U);
}

}  // namespace
}  // namespace diastole
