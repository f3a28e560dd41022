#include <gtest/gtest.h>

#include "tests/link_faults/every_rate.hpp"

namespace diastole::link_faults {
namespace {

TEST(Campaign, NoWrongCommandAtAnyRate) { expect_no_wrong_command(50'000); }

TEST(Campaign, AForgedCommandIsCounted) {
  CampaignOptions options = at_rate(1e-4, 1'000, 3);
  options.forge_a_command = true;
  EXPECT_GT(run_campaign(options).wrong, 0U);
}

TEST(Campaign, EqualSeedsGiveEqualCampaigns) {
  const auto options = at_rate(1e-3, 3'000, 8);
  EXPECT_EQ(table_row(options, run_campaign(options)), table_row(options, run_campaign(options)));
}

}  // namespace
}  // namespace diastole::link_faults
