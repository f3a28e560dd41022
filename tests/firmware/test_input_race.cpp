// An input that changes while a request is being carried out: its interrupt comes between two lines of the main loop.

#include <gtest/gtest.h>

#include <functional>

#include "firmware/boards/recording/recording_board.hpp"
#include "firmware/core/controller.hpp"
#include "protocol/wire/messages.hpp"

namespace diastole::firmware {
namespace {

/// The emergency stop's contact opens for a moment just before the motor gets its current.
class BouncingBoard : public RecordingBoard {
 public:
  using RecordingBoard::RecordingBoard;

  void set_motor_enabled(bool enabled) {
    if (enabled) {
      set_estop(true);
      input_interrupt();
      set_estop(false);
    }
    RecordingBoard::set_motor_enabled(enabled);
  }

  std::function<void()> input_interrupt;
};

class Desk {
 public:
  Desk() {
    board.input_interrupt = [this] { controller.on_inputs(); };
    link.open(1, 0);
    turn();
    turn();
  }

  template <class Message>
  void send(const Message& message) {
    std::array<std::uint8_t, wire::kMaxPayloadBytes> payload{};
    ASSERT_TRUE(link.send(Message::kType, wire::encode(message, payload)));
    turn();
    turn();
  }
  void turn() {
    const std::uint64_t now_us = on_wire(board.now()) / 84;
    for (auto bytes = link.transmit(now_us); !bytes.empty(); bytes = link.transmit(now_us))
      board.receive(bytes);
    controller.poll();
    bool inputs_changed = false;
    board.run_to(board.now() + microseconds(5'000), inputs_changed);
    for (const std::uint8_t byte : board.take_sent())
      (void)link.receive(byte, now_us);
  }

  BouncingBoard board{RecordingBoard::Options{}};
  Controller<BouncingBoard> controller{board};
  wire::ReliableLink link{wire::ReliableLink::Role::host};
};

TEST(InputRace, AnEmergencyStopWhileTheMotorIsBeingPoweredLeavesItWithout) {
  Desk desk;
  ASSERT_EQ(desk.link.state(), wire::ReliableLink::State::open);
  desk.send(wire::HelloRequest{1, wire::kSchemaHash, 0, 1, 0});
  desk.send(wire::Configure::example());
  desk.send(wire::Heartbeat{7});
  desk.send(wire::Jog{2, 7, 1'000'000, 5'000});
  EXPECT_EQ(desk.controller.motion().safety().fault(), wire::Fault::estop);
  std::int32_t powered = 0;
  for (int i = 0; i < 20; ++i)
    desk.turn();
  for (const Edge& edge : desk.board.take_edges()) {
    EXPECT_NE(edge.signal, Signal::STEP);
    if (edge.signal == Signal::ENABLE) powered = edge.value;
  }
  EXPECT_EQ(powered, 0) << "a latched emergency stop with the motor under current";
  EXPECT_FALSE(desk.controller.motion().motor_enabled());
}

}  // namespace
}  // namespace diastole::firmware
