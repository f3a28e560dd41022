#include <fmt/format.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "host/daq/driver.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/host/bench/scratch.hpp"
#include "tests/host/daq/configured.hpp"
#include "tests/host/daq/pseudo_terminal.hpp"
#include "tests/host/daq/recorded_session.hpp"

namespace diastole::daq {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using namespace std::chrono_literals;

/// Every driver of the list must refuse a [daq] table without a channel's own keys, by name.
class EveryDriver : public testing::TestWithParam<const Driver*> {};

TEST_P(EveryDriver, RefusesAnEmptyChannelWithPlaceAndRemedy) {
  TableReader root = TableReader::from_text("[daq]\nhost = \"h\"\n[[daq.channel]]\n", "rig.toml");
  TableReader table = root.table("daq");
  std::vector<TableReader> blocks = table.tables("channel");
  EXPECT_THAT(message_of<InputError>([&] { GetParam()->configure(table, blocks); }),
              AllOf(HasSubstr("rig.toml"), HasSubstr("is missing")));
}

/// The instrument of a recording, played over the line that its driver uses.
class Player {
 public:
  Player(const Driver& driver, const RecordedSession& session)
      : session_(session), hid_(driver.line == Line::hid) {
    const std::string line = driver.line == Line::tcp      ? tcp_line()
                             : driver.line == Line::serial ? serial_line()
                                                           : "";
    open_ = configured_any(driver.configure, session.daq + line, session.channels);
    if (hid_) options_.open_hid = [this](const HidAddress&) { return std::make_unique<Port>(*this); };
    if (driver.line == Line::none) options_.now_ns = [this] { return 100'000'000 * now_tenths_++; };
  }
  ~Player() {
    thread_.request_stop();
    if (thread_.joinable()) thread_.join();
    EXPECT_EQ(fault_, "");
    EXPECT_EQ(next_, hid_ ? session_.steps.size() : 0) << "not all of the recording was asked for";
  }
  Player(const Player&) = delete;
  Player& operator=(const Player&) = delete;

  [[nodiscard]] std::unique_ptr<Instrument> open() const { return open_(options_); }

 private:
  std::string serial_line() {
    serve([this] { return terminal_.receive(10ms); },
          [this](std::span<const uint8_t> bytes) { terminal_.send(bytes); });
    return "port = \"" + terminal_.path() + "\"\ntimeout_ms = 1000\n";
  }

  std::string tcp_line() {
    const int listener = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    listener_ = Descriptor(listener);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(listener, reinterpret_cast<const sockaddr*>(&address), size), 0);
    EXPECT_EQ(::listen(listener, 1), 0);
    ::getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);
    serve(
        [this] {
          if (!client_.valid())
            client_ = Descriptor(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
          pollfd state{client_.get(), POLLIN, 0};
          if (::poll(&state, 1, 10) <= 0) return std::vector<uint8_t>{};
          std::vector<uint8_t> bytes(512);
          bytes.resize(static_cast<size_t>(std::max<ssize_t>(0, ::read(client_.get(), bytes.data(), 512))));
          return bytes;
        },
        [this](std::span<const uint8_t> bytes) {
          (void)!::write(client_.get(), bytes.data(), bytes.size());
        });
    return "host = \"127.0.0.1\"\ntimeout_ms = 1000\nport = " + std::to_string(ntohs(address.sin_port)) +
           "\n";
  }

  class Port final : public HidPort {
   public:
    explicit Port(Player& player) : player_(player) {}
    bool write_output(std::span<const uint8_t> report) override {
      if (player_.next_ == player_.session_.steps.size()) return true;
      const auto& step = player_.session_.steps[player_.next_++];
      EXPECT_TRUE(step.asked);
      EXPECT_TRUE(std::equal(report.begin(), report.end(), step.bytes.begin(), step.bytes.end()));
      return true;
    }
    std::vector<uint8_t> read_feature(size_t) override {
      const auto& step = player_.session_.steps.at(player_.next_++);
      EXPECT_FALSE(step.asked);
      return step.bytes;
    }
    [[nodiscard]] std::string problem() const override { return {}; }

   private:
    Player& player_;
  };

  void serve(std::function<std::vector<uint8_t>()> receive,
             std::function<void(std::span<const uint8_t>)> send) {
    thread_ = std::jthread([this, receive, send](const std::stop_token& stop) {
      fault_ = play(session_, receive, send, [&stop] { return stop.stop_requested(); });
    });
  }

  const RecordedSession& session_;
  PseudoTerminal terminal_;
  Descriptor listener_, client_;
  bool hid_;
  uint64_t now_tenths_ = 0;  // of a second, where nothing but time is played
  size_t next_ = 0;          // step, where the player is called and has no thread
  std::string fault_;
  OpenInstrument open_;
  OpenOptions options_ = patient;
  std::jthread thread_;
};

TEST_P(EveryDriver, ReplaysItsRecording) {
  const Driver& driver = *GetParam();
  const std::string recording =
      fmt::format(DIASTOLE_SOURCE_DIR "/tests/host/daq/recordings/{}.session", driver.name);
  if (driver.line == Line::none && !std::filesystem::exists(recording))
    GTEST_SKIP() << "speaks to no device, and nothing is recorded of it";
  const RecordedSession session = read_session(recording);
  ASSERT_TRUE(!session.steps.empty() || driver.line == Line::none)
      << "a driver leaves a recording: " << recording;
  ASSERT_FALSE(session.readings.empty());
  const Player player(driver, session);
  const auto instrument = player.open();
  auto* blocks = dynamic_cast<BlockInstrument*>(instrument.get());
  if (blocks != nullptr) {
    ASSERT_TRUE(blocks->start(blocks->plan_rate(300).rate_Hz).ok);
  }
  for (const std::vector<double>& expected : session.readings) {
    std::vector<double> read(instrument->channels());
    if (blocks != nullptr) {
      Batch batch;
      ASSERT_TRUE(blocks->read(batch).ok);
      read.assign(batch.volts.begin(), batch.volts.begin() + static_cast<std::ptrdiff_t>(read.size()));
      read.insert(read.begin(), static_cast<double>(batch.first_index));
    } else {
      ASSERT_TRUE(dynamic_cast<PolledInstrument&>(*instrument).read(read).ok);
    }
    EXPECT_THAT(read, testing::Pointwise(testing::DoubleNear(1e-6), expected));
  }
}

TEST_P(EveryDriver, IsNamedInLowerCaseWithDashes) {
  for (const char letter : GetParam()->name)
    EXPECT_TRUE(letter == '-' || (letter >= 'a' && letter <= 'z') || (letter >= '0' && letter <= '9'));
}

INSTANTIATE_TEST_SUITE_P(Daq, EveryDriver, testing::ValuesIn(drivers().begin(), drivers().end()),
                         [](const auto& each) {
                           std::string name(each.param->name);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace diastole::daq
