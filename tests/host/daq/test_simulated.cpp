#include <gmock/gmock.h>

#include "host/daq/driver.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/daq/configured.hpp"

namespace diastole::daq {
namespace {

constexpr uint64_t ms = 1'000'000;

TEST(Simulated, NumbersWhatItGivesAndLosesWhatIsNotTakenInTime) {
  uint64_t now_ns = 5 * ms;
  const auto instrument = configured_any(simulated_driver.configure, "",
                                         "[[daq.channel]]\ninput = 0\n")({.now_ns = [&] { return now_ns; }});
  auto& blocks = dynamic_cast<BlockInstrument&>(*instrument);
  ASSERT_TRUE(blocks.start(1000).ok);
  EXPECT_EQ(blocks.block_samples(), 20U);
  Batch batch;
  now_ns += 100 * ms;
  ASSERT_TRUE(blocks.read(batch).ok);
  EXPECT_EQ(batch.first_index, 0U);
  EXPECT_EQ(batch.volts.size(), 101U);
  ASSERT_TRUE(blocks.read(batch).ok);
  EXPECT_TRUE(batch.volts.empty()) << "nothing more is due";
  now_ns += 900 * ms;
  ASSERT_TRUE(blocks.read(batch).ok);
  EXPECT_EQ(batch.first_index, 800U) << "a buffer of 200 ms";
  EXPECT_EQ(batch.volts.size(), 201U);
}

TEST(Simulated, SaysThatNothingIsMeasuredAndIsNowhere) {
  const auto open = configured_any(simulated_driver.configure, "", "[[daq.channel]]\ninput = 0\n");
  EXPECT_THAT(open({})->plan_rate(10'000).warning, testing::HasSubstr("simulated"));
  EXPECT_THAT(message_of<InputError>([&] { (void)open({.address = "127.0.0.1:502"}); }),
              testing::HasSubstr("--daq 127.0.0.1:502"));
}

}  // namespace
}  // namespace diastole::daq
