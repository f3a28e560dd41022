#include "host/daq/usb1208ls_bytes.hpp"

#include <gmock/gmock.h>

#include <deque>

#include "host/daq/usb1208ls.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/daq/configured.hpp"

namespace diastole::daq {
namespace {

using namespace usb1208ls;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A block's report: all conversions 0 but for the first pairs, given as their bytes.
std::vector<uint8_t> report(uint16_t number, const std::vector<uint8_t>& packed = {}, uint8_t error = 0) {
  std::vector<uint8_t> bytes(block_report_bytes);
  std::copy(packed.begin(), packed.end(), bytes.begin() + 1);
  bytes[97] = error;
  bytes[102] = static_cast<uint8_t>(number);
  bytes[103] = static_cast<uint8_t>(number >> 8U);
  return bytes;
}

TEST(Usb1208lsBytes, TheDrawnExampleDecodes) {
  const auto block = decode_block(report(0x0102, {0x34, 0xF1, 0xFF}));
  ASSERT_TRUE(block);
  EXPECT_EQ(block->number, 0x0102);
  EXPECT_EQ(block->counts[0], -204);
  EXPECT_EQ(block->counts[1], 511);
  EXPECT_EQ(block->counts[2], 0);
  EXPECT_NEAR(volts(block->counts[0], ranges[1]), -0.9966, 1e-4);
  EXPECT_NEAR(volts(block->counts[1], ranges[1]), 2.4963, 1e-4);
}

TEST(Usb1208lsBytes, EveryPairOfConversionsComesBack) {
  for (int s0 = -2048; s0 < 2048; s0 += 7) {
    const int s1 = -1 - s0;
    const auto low = static_cast<uint8_t>(s0);
    const auto middle = static_cast<uint8_t>((s0 >> 4 & 0xF0) | (s1 >> 8 & 0x0F));
    const auto block = decode_block(report(1, {low, middle, static_cast<uint8_t>(s1)}));
    ASSERT_TRUE(block);
    ASSERT_EQ(block->counts[0], s0);
    ASSERT_EQ(block->counts[1], s1);
  }
}

TEST(Usb1208lsBytes, AReportOfAnotherLengthIsNone) {
  for (const size_t bytes : {size_t{0}, size_t{104}, size_t{106}})
    EXPECT_FALSE(decode_block(std::vector<uint8_t>(bytes)));
}

TEST(Usb1208lsBytes, ThreeHundredHertzIsThreeHundredPointFourEight) {
  const Pace pace = pace_for(300);
  EXPECT_NEAR(pace.rate_Hz(), 300.48, 0.005);
  EXPECT_THAT(start_scan(pace), ElementsAre(0x0E, 64, 0, 100, 6, 0x04, 0, 0));
  EXPECT_THAT(start_scan(pace_for(1200)), ElementsAre(0x0E, 64, 0, 101, 4, 0x04, 0, 0));
  for (double rate_Hz = least_conversions_Hz; rate_Hz <= most_conversions_Hz; rate_Hz += 13)
    EXPECT_NEAR(pace_for(rate_Hz).rate_Hz(), rate_Hz, 0.005 * rate_Hz);
}

TEST(Usb1208lsBytes, TheQueueNamesChannelAndRange) {
  const std::array queue{QueueEntry{0, ranges[1]}, QueueEntry{3, ranges[7]}};
  EXPECT_THAT(load_queue(queue), ElementsAre(0x07, 2, 0x90, 0xF3, 0, 0, 0, 0));
}

TEST(Usb1208lsBytes, BlocksAreCountedThroughTheWrapAndHolesSeen) {
  BlockCounter counter;
  EXPECT_EQ(counter.take(1), 0U);
  EXPECT_EQ(counter.take(2), 1U);
  EXPECT_EQ(counter.take(5), 4U);
  EXPECT_FALSE(counter.take(5)) << "the same again";
  EXPECT_FALSE(counter.take(3));
  uint64_t expected = 5;
  for (; expected < 200'000; ++expected)
    ASSERT_EQ(counter.take(static_cast<uint16_t>(expected + 1)), expected);
  EXPECT_EQ(counter.take(static_cast<uint16_t>(expected + 3)), expected + 2);
}

/// Answers feature requests from a list; an empty report: the device does not answer.
struct FakeDevice {
  std::vector<std::vector<uint8_t>> written;
  std::deque<std::vector<uint8_t>> reports;
  int opened = 0;
  bool absent = false;

  OpenHid open() {
    return [this](const HidAddress& address) -> std::unique_ptr<HidPort> {
      EXPECT_EQ(address.vendor_id, 0x09DB);
      EXPECT_EQ(address.product_id, 0x007A);
      if (absent) throw HardwareError("USB device 09db:007a", "is not there", "Plug it in.");
      ++opened;
      return std::make_unique<Port>(*this);
    };
  }

  class Port final : public HidPort {
   public:
    explicit Port(FakeDevice& device) : device_(device) {}
    bool write_output(std::span<const uint8_t> bytes) override {
      device_.written.emplace_back(bytes.begin(), bytes.end());
      return true;
    }
    std::vector<uint8_t> read_feature(size_t) override {
      if (device_.reports.empty()) return {};
      auto next = device_.reports.front();
      device_.reports.pop_front();
      return next;
    }
    [[nodiscard]] std::string problem() const override { return "unplugged"; }

   private:
    FakeDevice& device_;
  };
};

Usb1208lsSetup with_channels(size_t channels) {
  Usb1208lsSetup setup;
  for (size_t i = 0; i < channels; ++i)
    setup.queue.push_back({static_cast<uint8_t>(i), ranges[1]});
  return setup;
}

TEST(Usb1208ls, StartsAScanAndHandsOverItsBlocks) {
  FakeDevice device;
  const auto instrument = open_usb1208ls(with_channels(1), device.open());
  const RatePlan plan = instrument->plan_rate(300);
  EXPECT_NEAR(plan.rate_Hz, 300.48, 0.005);
  EXPECT_THAT(plan.warning, IsEmpty());
  EXPECT_EQ(instrument->block_samples(), 64U);
  ASSERT_TRUE(instrument->start(plan.rate_Hz).ok);
  ASSERT_EQ(device.written.size(), 3U);
  EXPECT_THAT(device.written[2], ElementsAre(0x0E, 64, 0, 100, 6, 0x04, 0, 0));
  device.reports = {report(1, {0x34, 0xF1, 0xFF}), report(3)};
  Batch batch;
  ASSERT_TRUE(instrument->read(batch).ok);
  EXPECT_EQ(batch.first_index, 0U);
  ASSERT_EQ(batch.volts.size(), 64U);
  EXPECT_NEAR(batch.volts[1], 2.4963, 1e-4);
  ASSERT_TRUE(instrument->read(batch).ok);
  EXPECT_EQ(batch.first_index, 128U) << "block 2 was lost";
  EXPECT_EQ(batch.volts.size(), 64U);
}

TEST(Usb1208ls, ChannelsAreTakenInTurnAndThreeAreSampledAsFour) {
  FakeDevice device;
  const auto instrument = open_usb1208ls(with_channels(3), device.open());
  EXPECT_NEAR(instrument->plan_rate(300).rate_Hz, 300.48, 0.005);
  EXPECT_EQ(instrument->block_samples(), 16U);
  ASSERT_TRUE(instrument->start(300).ok);
  // Conversions 1, 2, 3, 4 and 5, 6, 7, 8: the fourth and eighth are the third channel once more.
  device.reports = {report(1), report(2, {1, 0, 2, 3, 0, 4, 5, 0, 6, 7, 0, 8})};
  Batch batch;
  ASSERT_TRUE(instrument->read(batch).ok);
  ASSERT_TRUE(instrument->read(batch).ok);
  EXPECT_EQ(batch.first_index, 16U);
  ASSERT_EQ(batch.volts.size(), 48U);
  const double V_per_count = 10 / 2047.0;
  const std::array expected{1, 2, 3, 5, 6, 7};
  for (size_t i = 0; i < expected.size(); ++i)
    EXPECT_DOUBLE_EQ(batch.volts[i], V_per_count * expected[i]);
}

TEST(Usb1208ls, ADeviceThatIsPulledOutFailsInWordsAndIsOpenedAnew) {
  FakeDevice device;
  const auto instrument = open_usb1208ls(with_channels(1), device.open());
  ASSERT_TRUE(instrument->start(300).ok);
  Batch batch;
  EXPECT_THAT(instrument->read(batch).fault, HasSubstr("unplugged"));
  device.absent = true;
  EXPECT_THAT(instrument->start(300).fault, HasSubstr("is not there"));
  device.absent = false;
  EXPECT_TRUE(instrument->start(300).ok);
  EXPECT_EQ(device.opened, 2);
  device.reports = {report(1)};
  EXPECT_TRUE(instrument->read(batch).ok);
  EXPECT_EQ(batch.first_index, 0U);
}

TEST(Usb1208ls, AnErrorOfTheDeviceIsTold) {
  FakeDevice device;
  const auto instrument = open_usb1208ls(with_channels(1), device.open());
  ASSERT_TRUE(instrument->start(300).ok);
  device.reports = {report(1, {}, 3)};
  Batch batch;
  EXPECT_THAT(instrument->read(batch).fault, HasSubstr("error 3"));
}

TEST(Usb1208ls, RatesThatItDoesNotHaveAreRefusedWithThoseItHas) {
  FakeDevice device;
  const auto instrument = open_usb1208ls(with_channels(4), device.open());
  EXPECT_NO_THROW((void)instrument->plan_rate(300));
  EXPECT_THAT(message_of<InputError>([&] { (void)instrument->plan_rate(1000); }),
              AllOf(HasSubstr("1000 Hz"), HasSubstr("25 to 300 Hz")));
}

TEST(Usb1208ls, TheRigFileNamesInputAndRange) {
  const auto configure = [](const std::string& channels) {
    return message_of<InputError>([&] { configured_any(usb1208ls_driver.configure, "", channels); });
  };
  EXPECT_EQ(configure("[[daq.channel]]\ninput = 0\nrange_V = 2.5\n"), "(no error)");
  EXPECT_THAT(configure("[[daq.channel]]\ninput = 4\n"), HasSubstr("input"));
  EXPECT_THAT(configure("[[daq.channel]]\ninput = 0\nrange_V = 3\n"),
              AllOf(HasSubstr("range_V"), HasSubstr("2.5")));
}

}  // namespace
}  // namespace diastole::daq
