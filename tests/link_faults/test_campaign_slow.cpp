#include <gtest/gtest.h>

#include "tests/link_faults/every_rate.hpp"

namespace diastole::link_faults {
namespace {

TEST(CampaignAtLength, NoWrongCommandInTwentyMillionFrames) { expect_no_wrong_command(3'000'000); }

}  // namespace
}  // namespace diastole::link_faults
