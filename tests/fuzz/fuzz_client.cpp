// The daemon's controller client before a controller that says anything: it may refuse, lose the link and time
// out, and must neither crash nor hang. `other` lets the client act: connect, home, load, start, stop, ask.

#include <deque>
#include <filesystem>

#include "host/controller/controller_client.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/wire/messages.hpp"
#include "tests/fuzz/script.hpp"

namespace {

using namespace diastole;

class VirtualClock final : public Clock {
 public:
  [[nodiscard]] std::uint64_t now_ns() override { return now_ns_; }
  void sleep_until_ns(std::uint64_t until_ns, ByteLine*) override { now_ns_ = std::max(now_ns_, until_ns); }
  [[nodiscard]] bool stands_still() const override { return true; }

 private:
  std::uint64_t now_ns_ = 1'000'000'000;
};

/// The controller's end: greets as it should, acknowledges requests if told so, and says what the script wants.
class Stage {
 public:
  explicit Stage(VirtualClock& clock) : clock_(clock) {}

  void hear(std::span<const std::uint8_t> bytes) {
    for (const std::uint8_t byte : bytes) {
      const auto received = link.receive(byte, now_us());
      if (!received) continue;
      wire::visit_message(received->type, received->payload,
                          wire::overloaded{[&](const wire::HelloRequest& request) {
                                             wire::Hello hello = wire::Hello::example();
                                             hello.request_id = request.request_id;
                                             hello.schema_hash = wire::kSchemaHash;
                                             say(hello);
                                           },
                                           [&](const wire::ReadSettings& request) {
                                             wire::SettingsReport report;
                                             report.request_id = request.request_id;
                                             say(report);
                                           },
                                           [&](const wire::StatusRequest& request) {
                                             wire::Status status;
                                             status.request_id = request.request_id;
                                             say(status);
                                           },
                                           [&](const auto& request) {
                                             if constexpr (requires { request.request_id; })
                                               if (acknowledges)
                                                 say(wire::Ack{request.request_id, received->type});
                                           }});
    }
  }
  std::size_t speak(std::span<std::uint8_t> out) {
    for (auto bytes = link.transmit(now_us()); !bytes.empty(); bytes = link.transmit(now_us()))
      to_host.insert(to_host.end(), bytes.begin(), bytes.end());
    const std::size_t count = std::min(out.size(), to_host.size());
    const auto end = to_host.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(to_host.begin(), end, out.begin());
    to_host.erase(to_host.begin(), end);
    return count;
  }

  wire::ReliableLink link{wire::ReliableLink::Role::controller};
  std::deque<std::uint8_t> to_host;
  bool acknowledges = true;

 private:
  template <class Message>
  void say(const Message& message) {
    std::array<std::uint8_t, wire::kMaxPayloadBytes> memory{};
    (void)link.send(Message::kType, wire::encode(message, memory));
  }
  [[nodiscard]] std::uint64_t now_us() const { return clock_.now_ns() / 1000; }
  VirtualClock& clock_;
};

class StageLine final : public ByteLine {
 public:
  explicit StageLine(Stage& stage) : stage_(stage) {}
  void write(std::span<const std::uint8_t> bytes) override { stage_.hear(bytes); }
  std::size_t read(std::span<std::uint8_t> out) override { return stage_.speak(out); }
  void flush(int) override {}
  void wait_received(std::uint64_t, int) override {}
  [[nodiscard]] bool lost() const override { return false; }
  [[nodiscard]] std::uint64_t written_total() const override { return 0; }
  [[nodiscard]] std::uint64_t received_total() const override { return 0; }
  [[nodiscard]] int descriptor() const override { return -1; }

 private:
  Stage& stage_;
};

const RigConfig& rig() {
  static const RigConfig config = read_rig(std::filesystem::path(DIASTOLE_SOURCE_DIR) / "examples/rig.toml");
  return config;
}

const Experiment& experiment() {
  static const Experiment chosen = parse_experiment(R"(
    format = "diastole-experiment"
    version = 1
    [[segment]]
    waveform = "parabolic"
    stroke_mL = 40.0
    period_s = 1.2
    cycles = 5
    )",
                                                    "fuzz");
  return chosen;
}

void act(ControllerClient& client, Stage& stage, std::uint8_t what) {
  switch (what % 8) {
    case 0:
      return client.connect();
    case 1:
      return client.home();
    case 2:
      return static_cast<void>(client.load(experiment()));
    case 3:
      return client.start();
    case 4:
      return client.stop_now();
    case 5:
      return static_cast<void>(client.status());
    case 6:
      return client.clear_fault();
    default:
      stage.acknowledges = !stage.acknowledges;
  }
}

void play(ControllerClient& client, VirtualClock& clock, Stage& stage, fuzz::Script& script) {
  std::array<std::uint8_t, wire::kMaxEncodedBytes> memory{};
  switch (script.step()) {
    case fuzz::Step::raw: {
      const auto bytes = script.sized();
      stage.to_host.insert(stage.to_host.end(), bytes.begin(), bytes.end());
      break;
    }
    case fuzz::Step::message: {
      const auto type = static_cast<wire::MessageType>(script.byte());
      (void)stage.link.send(type, script.sized());
      break;
    }
    case fuzz::Step::frame: {
      const auto bytes = script.frame(stage.link.session(), memory);
      stage.to_host.insert(stage.to_host.end(), bytes.begin(), bytes.end());
      break;
    }
    case fuzz::Step::time:
      clock.sleep_until_ns(clock.now_ns() + 4'000'000ULL * script.byte(), nullptr);
      break;
    case fuzz::Step::other:
      act(client, stage, script.byte());
      break;
  }
  client.service();
  (void)client.take_events();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  VirtualClock clock;
  Stage stage(clock);
  ControllerClient client(clock, rig(), [&stage] { return std::make_unique<StageLine>(stage); });
  fuzz::Script script({data, size});
  client.connect();
  int refusals = 0;  // each may cost a second of turns
  while (!script.done() && refusals < 4) {
    try {
      play(client, clock, stage, script);
    } catch (const HardwareError&) {
      ++refusals;
    } catch (const InputError&) {
      ++refusals;
    }
  }
  fuzz::must(client.last_known().state <= wire::kLastState);
  return 0;
}
