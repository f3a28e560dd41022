#include "host/controller/controller_client.hpp"

#include <gmock/gmock.h>

#include <array>
#include <functional>

#include "host/controller/controller_words.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/desk.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* gel = R"(
format = "diastole-experiment"
version = 1
rest_s = 0.2
[[segment]]
waveform = "parabolic"
stroke_mL = 10
period_s = 1.0
cycles = 2
)";

struct ClientOnDesk : testing::Test {
  Desk desk;
  DeskClock clock{desk};
  RigConfig rig = example_rig();
  ControllerClient client{clock, rig, [this] { return std::make_unique<DeskLine>(desk); }};

  void pass(double seconds) {
    const uint64_t end_ns = desk.now_ns + static_cast<uint64_t>(1e9 * seconds);
    while (desk.now_ns < end_ns) {
      client.service();
      clock.sleep_until_ns(std::min(end_ns, client.next_due_ns()), nullptr);
    }
    client.service();
  }
  void home() {
    client.home();
    while (client.status().state == wire::State::homing)
      pass(0.05);
  }
};

TEST_F(ClientOnDesk, GreetsAndHomes) {
  client.connect();
  EXPECT_TRUE(client.connected());
  EXPECT_EQ(client.hello().schema_hash, wire::kSchemaHash);
  home();
  EXPECT_EQ(client.status().state, wire::State::homed);
}

TEST_F(ClientOnDesk, AProgramIsPlannedAndArmed) {
  client.connect();
  home();
  const ProgramPlan plan = client.load(parse_experiment(gel, "gel.experiment.toml"));
  ASSERT_EQ(plan.size(), 1U);
  EXPECT_EQ(plan[0].start_us, 200'000U);
  EXPECT_EQ(plan[0].duration_us, 2'000'000U);
  EXPECT_EQ(client.status().state, wire::State::armed);
}

TEST_F(ClientOnDesk, AProgramThatAHostLeftArmedIsTakenOutByTheNext) {
  client.connect();
  home();
  client.load(parse_experiment(gel, "gel.experiment.toml"));
  client.disconnect();
  client.connect();
  EXPECT_EQ(client.status().state, wire::State::homed);
  EXPECT_FALSE(client.found_moving());
}

TEST_F(ClientOnDesk, AnImpossibleProfileNamesSegmentLimitAskedAndAllowed) {
  client.connect();
  home();
  Experiment wild = parse_experiment(gel, "wild.experiment.toml");
  wild.segments[0].stroke_mL = 400;
  wild.segments[0].period_s = 0.3;
  const std::string message = message_of<InputError>([&] { client.load(wild); });
  EXPECT_THAT(message, AllOf(HasSubstr("wild.experiment.toml"), HasSubstr("segment[0]"), HasSubstr("limit"),
                             HasSubstr("asked"), HasSubstr("allowed")));
}

TEST_F(ClientOnDesk, AnUnhomedPumpDoesNotRunAndTheRemedyIsNamed) {
  client.connect();
  const std::string message =
      message_of<HardwareError>([&] { client.load(parse_experiment(gel, "gel.experiment.toml")); });
  EXPECT_THAT(message, HasSubstr("diastole home"));
}

TEST_F(ClientOnDesk, ANumberThatTheWireCannotCarryIsRefusedByNameInsteadOfWrapping) {
  rig.hose_inertance_kg_m4 = 4.5e9;
  EXPECT_THAT(message_of<InputError>([&] { client.connect(); }),
              AllOf(HasSubstr("inertance"), HasSubstr("4.5e+09"), HasSubstr("4294967295")));
  rig = example_rig();
  rig.microstep_mL = 1e-10;
  EXPECT_THAT(message_of<InputError>([&] { client.connect(); }),
              AllOf(HasSubstr("microstep"), HasSubstr("pL")));
}

TEST_F(ClientOnDesk, ARequestThatTheControllerCannotReadIsToldAsRefused) {
  rig.controller.lease_ms = 50;  // the protocol begins at 100
  EXPECT_THAT(message_of<HardwareError>([&] { client.connect(); }),
              AllOf(HasSubstr("refused"), HasSubstr("out of range")));
  EXPECT_FALSE(client.connected()) << "its heartbeats would prolong a motion";
}

TEST_F(ClientOnDesk, PositionsFollowTheSampleRateWithinBounds) {
  client.connect();
  home();
  for (const auto& [sample_rate_Hz, positions_Hz] :
       {std::pair{20'000.0, 1000.0}, {700.0, 700.0}, {50.0, 300.0}}) {
    Experiment experiment = parse_experiment(gel, "gel.experiment.toml");
    experiment.sample_rate_Hz = sample_rate_Hz;
    client.load(experiment);
    client.take_events();
    client.start();
    pass(3);
    size_t batches = 0;
    bool completed = false;
    for (const ControllerEvent& event : client.take_events()) {
      EXPECT_FALSE(std::holds_alternative<wire::FaultRaised>(event));
      if (const auto* ended = std::get_if<wire::RunEnded>(&event))
        completed = ended->reason == wire::RunEnd::completed;
      const auto* batch = std::get_if<wire::PositionBatch>(&event);
      if (batch == nullptr) continue;
      ++batches;
      EXPECT_EQ(batch->period_ticks, static_cast<uint32_t>(client.hello().tick_rate_Hz / positions_Hz));
    }
    EXPECT_GT(batches, 5U);
    EXPECT_TRUE(completed) << sample_rate_Hz;
  }
}

TEST_F(ClientOnDesk, AProgramThatTheLineCannotReportIsRefusedBeforeMotion) {
  rig.controller.baud = 38'400;
  client.connect();
  home();
  Experiment experiment = parse_experiment(gel, "gel.experiment.toml");
  EXPECT_EQ(client.load(experiment).size(), 1U);
  experiment.sample_rate_Hz = 1000;
  EXPECT_THAT(message_of<InputError>([&] { client.load(experiment); }),
              AllOf(HasSubstr("gel.experiment.toml"), HasSubstr("sample_rate_Hz"), HasSubstr("38400"),
                    HasSubstr("baud")));
  rig.controller.baud = 9600;
  experiment.sample_rate_Hz = 300;
  EXPECT_THAT(message_of<InputError>([&] { client.load(experiment); }), HasSubstr("9600"));
}

TEST_F(ClientOnDesk, ClocksAreCompared) {
  client.connect();
  client.take_events();
  pass(3);
  size_t readings = 0;
  for (const ControllerEvent& event : client.take_events()) {
    const auto* reading = std::get_if<ClockReading>(&event);
    if (reading == nullptr) continue;
    ++readings;
    const double controller_s =
        static_cast<double>(reading->tick) / static_cast<double>(client.hello().tick_rate_Hz);
    EXPECT_NEAR(controller_s, 1e-9 * static_cast<double>(reading->host_ns), 5e-4);
  }
  EXPECT_GE(readings, 10U);
}

TEST_F(ClientOnDesk, SilenceIsAHardwareError) {
  desk.plugged = false;
  EXPECT_THAT(message_of<HardwareError>([&] { client.connect(); }), HasSubstr("does not answer"));
}

TEST_F(ClientOnDesk, AResetIsSeenAndReconnectingWorks) {
  client.connect();
  desk.reset_controller();
  desk.controller_started_ns = desk.now_ns;
  pass(0.2);
  bool broken = false;
  for (const ControllerEvent& event : client.take_events())
    broken = broken || std::holds_alternative<LinkBroken>(event);
  EXPECT_TRUE(broken);
  client.connect();
  EXPECT_TRUE(client.connected());
}

struct Motion {
  wire::State state;
  wire::State after;  ///< its controlled stop
  std::function<void(ClientOnDesk&)> begin;
};

TEST_F(ClientOnDesk, AMotionFoundOnConnectingIsStoppedAndNothingRestarts) {
  const std::array<Motion, 3> motions{{
      {wire::State::homing, wire::State::unhomed, [](ClientOnDesk& test) { test.client.home(); }},
      {wire::State::jogging, wire::State::homed,
       [](ClientOnDesk& test) {
         test.home();
         test.client.jog(20, 10);
       }},
      {wire::State::running, wire::State::homed,
       [](ClientOnDesk& test) {
         test.client.load(parse_experiment(gel, "gel.experiment.toml"));
         test.client.start();
       }},
  }};
  client.connect();
  EXPECT_FALSE(client.found_moving());
  for (const Motion& motion : motions) {
    motion.begin(*this);
    pass(0.6);
    ASSERT_EQ(client.status().state, motion.state);
    desk.plugged = false;
    pass(0.1);
    ASSERT_FALSE(client.connected());
    desk.plugged = true;
    client.connect();
    EXPECT_EQ(client.found_moving(), motion.state);
    const wire::Status stopped = client.status();
    EXPECT_EQ(stopped.state, motion.after);
    EXPECT_EQ(stopped.fault, wire::Fault::none);
    pass(3);
    EXPECT_EQ(client.status().steps, stopped.steps);
    EXPECT_EQ(client.status().state, motion.after);
    client.connect();
    EXPECT_FALSE(client.found_moving());
    if (motion.after == wire::State::unhomed) home();
  }
}

TEST_F(ClientOnDesk, AnotherHostsMotionIsStoppedAndOrdersAreTakenAtOnce) {
  client.connect();
  home();
  client.jog(20, 10);
  pass(0.3);
  ControllerClient next(clock, rig, [this] { return std::make_unique<DeskLine>(desk); });
  next.connect();
  EXPECT_EQ(next.found_moving(), wire::State::jogging);
  next.jog(1, 5);
  EXPECT_EQ(next.status().state, wire::State::jogging);
}

TEST_F(ClientOnDesk, AFaultedControllerIsConnectedAndConfiguredOnceItIsCleared) {
  const auto press = [&](bool pressed) {
    desk.controller->set_estop(pressed);
    desk.advance_to(desk.now_ns + 100'000'000);
  };
  press(true);
  client.connect();
  EXPECT_EQ(client.last_known().fault, wire::Fault::estop);
  EXPECT_FALSE(client.configured());
  EXPECT_THAT(message_of<HardwareError>([&] { client.home(); }),
              AllOf(HasSubstr("emergency stop"), HasSubstr("release"), HasSubstr("clear-fault")));
  EXPECT_THAT(message_of<HardwareError>([&] { client.clear_fault(); }), HasSubstr("release"));
  EXPECT_FALSE(client.configured());
  press(false);
  client.clear_fault();
  EXPECT_TRUE(client.configured());
  home();
  EXPECT_EQ(client.status().state, wire::State::homed);
}

TEST_F(ClientOnDesk, CountersFollowARunWithoutBeingAskedFor) {
  client.connect();
  home();
  Experiment experiment = parse_experiment(gel, "gel.experiment.toml");
  experiment.segments[0].cycles = 5;
  client.load(experiment);
  const wire::Status before = client.status();
  client.start();
  wire::Status last = before;
  uint64_t changes = 0;
  for (int i = 0; i < 1000 && (last.cycle < 5 || last.state == wire::State::running); ++i) {
    pass(0.0137);
    const wire::Status& now = client.last_known();
    EXPECT_GE(now.triggers, last.triggers);
    EXPECT_GE(now.r_waves, last.r_waves);
    EXPECT_GE(now.steps, last.steps);
    changes += now.steps != last.steps ? 1 : 0;
    last = now;
  }
  EXPECT_GE(changes, 8U);
  const wire::Status after = client.status();
  EXPECT_EQ(last.triggers, after.triggers);
  EXPECT_EQ(last.r_waves, after.r_waves);
  EXPECT_EQ(last.cycle, after.cycle);
  EXPECT_EQ(after.triggers, before.triggers + 5);
}

/// A controller of another version: answers every frame by the book, but with another schema.
class ForeignLine final : public ByteLine {
 public:
  explicit ForeignLine(uint8_t version_minor) : version_minor_(version_minor) {}
  void write(std::span<const uint8_t> bytes) override {
    for (const uint8_t byte : bytes) {
      const auto message = link_.receive(byte, 0);
      if (!message || static_cast<wire::MessageType>(message->type) != wire::MessageType::HelloRequest)
        continue;
      const auto request = wire::decode<wire::HelloRequest>(message->payload);
      wire::Hello hello;
      hello.request_id = request->request_id;
      hello.schema_hash = wire::kSchemaHash ^ 1U;
      hello.version_minor = version_minor_;
      std::array<uint8_t, wire::kMaxPayloadBytes> memory{};
      (void)link_.send(wire::Hello::kType, wire::encode(hello, memory));
    }
  }
  size_t read(std::span<uint8_t> out) override {
    const auto frame = link_.transmit(0);
    std::copy(frame.begin(), frame.end(), out.begin());
    return frame.size();
  }
  void flush(int) override {}
  void wait_received(uint64_t, int) override {}
  [[nodiscard]] bool lost() const override { return false; }
  [[nodiscard]] uint64_t written_total() const override { return 0; }
  [[nodiscard]] uint64_t received_total() const override { return 0; }
  [[nodiscard]] int descriptor() const override { return -1; }

 private:
  uint8_t version_minor_;
  wire::ReliableLink link_{wire::ReliableLink::Role::controller};
};

TEST_F(ClientOnDesk, NewerFirmwareTellsToUpdateTheProgram) {
  ControllerClient foreign(clock, rig, [] { return std::make_unique<ForeignLine>(9); });
  EXPECT_THAT(message_of<HardwareError>([&] { foreign.connect(); }),
              AllOf(HasSubstr("firmware 0.9.0"), HasSubstr("this program 0.1.0"),
                    HasSubstr("apt install ./diastole_0.9.0"), Not(HasSubstr("diastole flash"))));
}

TEST_F(ClientOnDesk, OlderFirmwareTellsWhatToFlash) {
  ControllerClient foreign(clock, rig, [] { return std::make_unique<ForeignLine>(0); });
  EXPECT_THAT(message_of<HardwareError>([&] { foreign.connect(); }),
              AllOf(HasSubstr("firmware 0.0.0"), HasSubstr("the older one"),
                    HasSubstr("diastole-stm32f405.image --port " + rig.controller.port)));
}

TEST(VersionMatch, EqualVersionsOfAnotherProtocolAreCuredByFlashing) {
  wire::Hello hello;
  hello.schema_hash = 5;
  hello.version_minor = 1;
  EXPECT_FALSE(compare_versions(hello, {0, 1, 0}, 5, "/dev/x").has_value());
  EXPECT_THAT(compare_versions(hello, {0, 1, 0}, 6, "/dev/x")->remedy, HasSubstr("another build"));
}

}  // namespace
}  // namespace diastole
