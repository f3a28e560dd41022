#include "host/controller/controller_client.hpp"

#include <gmock/gmock.h>

#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/desk.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

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

/// A controller of another version: answers every frame by the book, but with another schema.
class ForeignLine final : public ByteLine {
 public:
  void write(std::span<const uint8_t> bytes) override {
    for (const uint8_t byte : bytes) {
      const auto message = link_.receive(byte, 0);
      if (!message || static_cast<wire::MessageType>(message->type) != wire::MessageType::HelloRequest)
        continue;
      const auto request = wire::decode<wire::HelloRequest>(message->payload);
      wire::Hello hello;
      hello.request_id = request->request_id;
      hello.schema_hash = wire::kSchemaHash ^ 1U;
      hello.version_minor = 9;
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
  wire::ReliableLink link_{wire::ReliableLink::Role::controller};
};

TEST_F(ClientOnDesk, AnotherProtocolVersionTellsWhatToFlash) {
  ControllerClient foreign(clock, rig, [] { return std::make_unique<ForeignLine>(); });
  EXPECT_THAT(message_of<HardwareError>([&] { foreign.connect(); }),
              AllOf(HasSubstr("0.9.0"), HasSubstr("diastole flash")));
}

}  // namespace
}  // namespace diastole
