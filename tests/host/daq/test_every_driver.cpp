#include <gmock/gmock.h>

#include <algorithm>

#include "host/daq/driver.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::daq {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Every driver of the list must refuse a [daq] table without a channel's own keys, by name.
class EveryDriver : public testing::TestWithParam<Driver> {};

TEST_P(EveryDriver, RefusesAnEmptyChannelWithPlaceAndRemedy) {
  TableReader root = TableReader::from_text("[daq]\nhost = \"h\"\n[[daq.channel]]\n", "rig.toml");
  TableReader table = root.table("daq");
  std::vector<TableReader> blocks = table.tables("channel");
  EXPECT_THAT(message_of<InputError>([&] { GetParam().configure(table, blocks); }),
              AllOf(HasSubstr("rig.toml"), HasSubstr("is missing")));
}

TEST_P(EveryDriver, IsNamedInLowerCaseWithDashes) {
  for (const char letter : GetParam().name)
    EXPECT_TRUE(letter == '-' || (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9'));
}

INSTANTIATE_TEST_SUITE_P(Daq, EveryDriver, testing::ValuesIn(drivers().begin(), drivers().end()),
                         [](const auto& each) {
                           std::string name(each.param.name);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace diastole::daq
