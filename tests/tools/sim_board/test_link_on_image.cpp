// The link of the real image over a bad line: what it carries out is what was sent, in order, once, unaltered.

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/miniature_host.hpp"
#include "tools/sim_board/emulated_controller.hpp"

namespace diastole::sim_board_test {
namespace {

constexpr uint64_t ms = 1'000'000;  // ns

link_faults::FaultRates trouble(double bit_error) {
  return {.bit_error = bit_error,
          .byte_loss = 1e-4,
          .frame_loss = 1e-3,
          .repetition = 1e-2,
          .reordering = 1e-2,
          .truncation = 1e-3};
}

class LinkOnImage : public testing::TestWithParam<double> {
 protected:
  void set_line(MiniatureHost& host, const link_faults::FaultRates& rates) {
    host.to_controller.set_rates(rates);
    host.to_host.set_rates(rates);
  }
  /// A line that carries nothing for 100 ms becomes good.
  template <class Request>
  void post(MiniatureHost& host, const Request& request) {
    const uint64_t patient_until_ns = host.now_ns() + 100 * ms;
    for (auto id = host.post(request);; id = host.post(request)) {
      if (id) return asked_.push_back(*id);
      if (host.now_ns() >= patient_until_ns) set_line(host, {});
      host.run_for(ms);
    }
  }
  /// A new program; how long its segments last, as SegmentPlanned must say.
  std::vector<uint64_t> post_program(MiniatureHost& host) {
    std::vector<uint64_t> durations_us;
    post(host, wire::ClearProgram{});
    for (unsigned i = 1 + static_cast<unsigned>(random_() % 6); i > 0; --i) {
      const wire::AddSegment add{0,
                                 static_cast<wire::Waveform>(random_() % 5),
                                 1 + static_cast<uint32_t>(random_() % 100),
                                 1'000'000 + static_cast<uint32_t>(random_() % 5'000'000),
                                 0,
                                 900'000 + static_cast<uint32_t>(random_() % 1'000'000)};
      post(host, add);
      durations_us.push_back(uint64_t{add.cycles} * add.period_us);
    }
    post(host, wire::Arm::example());
    return durations_us;
  }

  std::mt19937 random_{static_cast<unsigned>(GetParam() * 1e6)};
  std::vector<uint16_t> asked_;
};

TEST_P(LinkOnImage, CarriesOutWhatWasSentInOrderOnceAndUnaltered) {
  if (!std::filesystem::exists(firmware))
    GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
  EmulatedController controller({read_image(firmware)});
  MiniatureHost host(controller);
  ASSERT_TRUE(host.prepare());
  host.acknowledged.clear();
  for (int spell = 0; spell < 20; ++spell) {
    host.planned.clear();
    set_line(host, trouble(GetParam()));
    const std::vector<uint64_t> durations_us = post_program(host);
    host.run_for(100 * ms);
    set_line(host, {});
    ASSERT_TRUE(host.run_until([&] { return host.planned.size() >= durations_us.size(); }, 2'000 * ms));
    host.run_for(20 * ms);
    ASSERT_EQ(host.acknowledged, asked_);
    ASSERT_EQ(host.planned.size(), durations_us.size());
    for (std::size_t i = 0; i < durations_us.size(); ++i)
      ASSERT_EQ(host.planned[i].duration_us, durations_us[i]);
  }
  EXPECT_TRUE(host.refused.empty());
  EXPECT_GT(host.to_controller.counts().damaged + host.to_host.counts().damaged, 0U);
  EXPECT_EQ(controller.board().statistics().serial_overruns, 0U);
}

INSTANTIATE_TEST_SUITE_P(BitErrors, LinkOnImage, testing::Values(1e-4, 1e-3, 1e-2));

}  // namespace
}  // namespace diastole::sim_board_test
