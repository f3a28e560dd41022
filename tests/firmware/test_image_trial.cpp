// The application's part in its own replacement.

#include <gtest/gtest.h>

#include "tests/firmware/bench.hpp"

namespace diastole::firmware {
namespace {

using Restart = RecordingBoard::Restart;
using wire::UpdateOutcome;

RecordedController::Options running(wire::ImageState state) {
  RecordedController::Options options;
  options.board.image = {wire::ImageSlot::b, state, {0, 1, 1}, 0xB17D, 30'000, 0x0804'0000};
  return options;
}

template <class Request>
UpdateOutcome asked(Bench& bench, const Request& request) {
  const std::size_t before = bench.heard.updates.size();
  bench.request(request);
  EXPECT_TRUE(bench.run_until([&] { return bench.heard.updates.size() > before; }, microseconds(1'000'000)));
  EXPECT_EQ(bench.heard.updates.back().request_type, static_cast<std::uint8_t>(Request::kType));
  return bench.heard.updates.back().outcome;
}

TEST(ImageTrial, EntersTheBootloaderOnlyAtRestAndDisarmedWithTheMotorOff) {
  Bench bench;
  bench.prepare();
  bench.add_segment(wire::Waveform::parabolic, 3, 40'000'000, 1'200'000);
  ASSERT_TRUE(bench.ask(wire::Arm::example()));
  EXPECT_EQ(asked(bench, wire::EnterBootloader{}), UpdateOutcome::not_at_rest) << "armed";
  wire::Start start{};
  start.lease_id = Bench::kLease;
  ASSERT_TRUE(bench.ask(start));
  bench.run_for(microseconds(1'000'000));
  EXPECT_EQ(asked(bench, wire::EnterBootloader{}), UpdateOutcome::not_at_rest) << "running";
  bench.run_until([&] { return !bench.heard.ended.empty(); }, microseconds(30'000'000));
  EXPECT_EQ(bench.rig.restart_asked(), Restart::none);
  EXPECT_EQ(asked(bench, wire::EnterBootloader{}), UpdateOutcome::done);
  EXPECT_FALSE(bench.rig.controller().motion().motor_enabled());
  bench.run_for(microseconds(100'000));
  EXPECT_EQ(bench.rig.restart_asked(), Restart::into_bootloader);
}

TEST(ImageTrial, AMotionAskedForAfterwardsTakesTheOrderBack) {
  Bench bench;
  bench.prepare();
  EXPECT_EQ(asked(bench, wire::EnterBootloader{}), UpdateOutcome::done);
  ASSERT_TRUE(bench.ask(wire::Home{0, Bench::kLease}));
  ASSERT_TRUE(bench.run_until([&] { return bench.state() == wire::State::homed; }, microseconds(60'000'000)));
  bench.run_for(microseconds(1'000'000));
  EXPECT_EQ(bench.rig.restart_asked(), Restart::none);
}

TEST(ImageTrial, AnswersAHostOfAnotherProtocolVersion) {
  Bench bench(running(wire::ImageState::on_trial));
  bench.link.open(9, 0);
  bench.run_for(microseconds(200'000));
  bench.request(wire::HelloRequest{0, wire::kSchemaHash + 1, 9, 9, 9});
  bench.request(wire::ImageQuery{0, wire::ImageSlot::none});
  EXPECT_TRUE(bench.run_until([&] { return !bench.heard.images.empty(); }, microseconds(1'000'000)));
  const wire::ImageReport& image = bench.heard.images.back();
  EXPECT_EQ(image.slot, wire::ImageSlot::b);
  EXPECT_EQ(image.free_slot, wire::ImageSlot::a);
  EXPECT_EQ(image.standing, wire::ImageState::on_trial);
  EXPECT_EQ(image.build_id, 0xB17DU);
  EXPECT_EQ(asked(bench, wire::ConfirmImage{0, 0xB17D}), UpdateOutcome::done);
  EXPECT_EQ(asked(bench, wire::EnterBootloader{}), UpdateOutcome::done);
}

TEST(ImageTrial, OnlyTheImageThatIsMeantIsConfirmed) {
  Bench bench(running(wire::ImageState::on_trial));
  bench.connect();
  EXPECT_EQ(asked(bench, wire::ConfirmImage{0, 0xBAD}), UpdateOutcome::other_image);
  bench.run_for(microseconds(21'000'000));
  EXPECT_EQ(bench.rig.restart_asked(), Restart::plain) << "nobody confirmed it";
}

TEST(ImageTrial, AConfirmedImageStays) {
  Bench bench(running(wire::ImageState::on_trial));
  bench.connect();
  EXPECT_EQ(asked(bench, wire::ConfirmImage{0, 0xB17D}), UpdateOutcome::done);
  EXPECT_EQ(asked(bench, wire::ConfirmImage{0, 0xB17D}), UpdateOutcome::done) << "repeated";
  bench.run_for(microseconds(60'000'000));
  EXPECT_EQ(bench.rig.restart_asked(), Restart::none);
}

TEST(ImageTrial, WhatOnlyABootloaderDoesIsRefused) {
  Bench bench;
  bench.connect();
  EXPECT_EQ(asked(bench, wire::FinishUpdate{}), UpdateOutcome::not_in_bootloader);
  EXPECT_EQ(asked(bench, wire::BeginUpdate::example()), UpdateOutcome::not_in_bootloader);
}

}  // namespace
}  // namespace diastole::firmware
