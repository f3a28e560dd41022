// The controller is reset in every state, by its button and by a power failure, with the daemon's own client on
// the line: the pins are safe at once, the client knows it within 200 ms by a new boot id, nothing moves by itself,
// and nothing runs before the pump is homed again.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "host/config/experiment.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/wire_text.hpp"
#include "tests/tools/sim_board/built_firmware.hpp"
#include "tests/tools/sim_board/emulated_desk.hpp"
#include "tests/tools/sim_board/miniature_host.hpp"

namespace diastole::sim_board_test {
namespace {

using sim_controller::Pin;
using wire::State;

struct Case {
  State state;
  bool power;  ///< fails and comes back; else the button is pressed
};

class ResetIn : public testing::TestWithParam<Case> {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(firmware))
      GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
    desk = std::make_unique<EmulatedDesk>(firmware);
    rig = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
    client = std::make_unique<ControllerClient>(*desk, rig,
                                                [this] { return std::make_unique<EmulatedLine>(*desk); });
    run_for(20 * ms);
    client->connect();
  }

  void turn() {
    client->service();
    for (ControllerEvent& event : client->take_events())
      if (std::holds_alternative<LinkBroken>(event)) broken = true;
    desk->sleep_until_ns(desk->now_ns() + ms, nullptr);
  }
  void run_for(uint64_t time_ns) {
    for (const uint64_t end_ns = desk->now_ns() + time_ns; desk->now_ns() < end_ns;)
      turn();
  }
  bool reach(State state) {
    for (const uint64_t end_ns = desk->now_ns() + 30'000 * ms; desk->now_ns() < end_ns; turn())
      if (client->last_known().state == state) return true;
    return false;
  }
  static Experiment experiment() {
    return parse_experiment(R"(
        format = "diastole-experiment"
        version = 1
        [[segment]]
        waveform = "parabolic"
        stroke_mL = 40.0
        period_s = 1.2
        cycles = 5
        )",
                            "five cycles");
  }

  void bring_to(State state) {
    if (state == State::unhomed) return;
    client->home();
    ASSERT_TRUE(reach(State::homing));
    if (state == State::homing) return run_for(30 * ms);
    ASSERT_TRUE(reach(State::homed));
    if (state == State::homed) return;
    client->load(experiment());
    if (state == State::armed) return;
    client->start();
    ASSERT_TRUE(reach(State::running));
    run_for(1'500 * ms);
    if (state == State::stopping) client->stop_at_cycle_end();
    if (state == State::faulted) desk->controller.press_estop(desk->now_ns() + ms);
    ASSERT_TRUE(reach(state));
  }

  void reset() {
    SimBoard& board = desk->controller.board();
    desk->controller.press_estop(desk->now_ns() + 1, false);
    desk->sleep_until_ns(desk->now_ns() + 2, nullptr);
    desk->edges.clear();
    GetParam().power ? board.power_cycle() : board.reset();
  }

  [[nodiscard]] bool level(board_model::Pin pin) const { return desk->controller.board().level(pin); }

  std::unique_ptr<EmulatedDesk> desk;
  RigConfig rig;
  std::unique_ptr<ControllerClient> client;
  bool broken = false;
};

TEST_P(ResetIn, IsSeenWithin200msAndLeavesTheRigSafe) {
  bring_to(GetParam().state);
  ASSERT_EQ(client->status().state, GetParam().state);
  const uint32_t boot_id = client->hello().boot_id;
  const int64_t position = desk->controller.position_microsteps();

  const uint64_t reset_ns = desk->now_ns();
  reset();
  const Wiring& wiring = diastole_wiring();
  for (const Wire& wire : {wiring.step, wiring.enable, wiring.ttl, wiring.fault})
    EXPECT_FALSE(level(wire.pin)) << "an output is on while the chip starts";

  while (!broken && desk->now_ns() < reset_ns + 1'000 * ms)
    turn();
  client->connect();
  EXPECT_LE(desk->now_ns() - reset_ns, 200 * ms);
  EXPECT_NE(client->hello().boot_id, boot_id);
  EXPECT_EQ(client->hello().reset_cause,
            GetParam().power ? wire::ResetCause::power_on : wire::ResetCause::reset_pin);

  run_for(1'000 * ms);
  const auto on = [](const sim_controller::PinEdge& edge) { return edge.pin != Pin::dir && edge.value != 0; };
  EXPECT_TRUE(std::ranges::none_of(desk->edges, on)) << "a pin went on by itself";
  EXPECT_EQ(desk->controller.position_microsteps(), position);
  EXPECT_EQ(client->status().state, State::unhomed);
  EXPECT_EQ(client->status().fault, wire::Fault::none);
  EXPECT_THROW(client->load(experiment()), HardwareError) << "nothing is planned before homing";

  client->home();
  EXPECT_TRUE(reach(State::homed));
  client->load(experiment());
  EXPECT_EQ(client->status().state, State::armed);
}

std::vector<Case> cases() {
  std::vector<Case> all;
  for (int state = 0; state <= static_cast<int>(wire::kLastState); ++state)
    for (const bool power : {false, true})
      if (static_cast<State>(state) != State::jogging) all.push_back({static_cast<State>(state), power});
  return all;
}

INSTANTIATE_TEST_SUITE_P(EveryState, ResetIn, testing::ValuesIn(cases()), [](const auto& each) {
  return std::string(wire::state_name(each.param.state)) + (each.param.power ? "_power" : "_button");
});

TEST(ResetWhileJogging, StopsTheMotorAndForgetsThePosition) {
  if (!std::filesystem::exists(firmware))
    GTEST_SKIP() << "no " << firmware << ": build the preset `firmware` first";
  EmulatedController controller({read_image(firmware)});
  MiniatureHost host(controller);
  ASSERT_TRUE(host.prepare());
  wire::Jog jog{};
  jog.lease_id = MiniatureHost::lease;
  jog.distance_nL = 20'000'000;
  jog.flow_uL_per_s = 5'000;
  ASSERT_TRUE(host.ask(jog));
  host.run_for(500 * ms);
  ASSERT_EQ(host.state, State::jogging);
  const uint32_t boot_id = host.hello->boot_id;
  const int64_t position = controller.position_microsteps();
  host.edges.clear();
  controller.board().reset();
  EXPECT_FALSE(controller.board().level(diastole_wiring().enable.pin));
  host.hello.reset();
  ASSERT_TRUE(host.connect());
  EXPECT_NE(host.hello->boot_id, boot_id);
  EXPECT_EQ(controller.position_microsteps(), position);
  EXPECT_TRUE(std::ranges::none_of(host.edges, [](const auto& edge) { return edge.pin == Pin::step; }));
  ASSERT_TRUE(host.ask(wire::Configure::example()));
  EXPECT_FALSE(host.ask(wire::Arm::example())) << "unhomed";
}

}  // namespace
}  // namespace diastole::sim_board_test
