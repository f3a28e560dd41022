#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "protocol/contract/conductor.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/tools/sim_rig/scripted_controller.hpp"
#include "tools/sim_rig/server.hpp"

namespace diastole::sim_rig {
namespace {

namespace fs = std::filesystem;

class TemporaryDirectory {
 public:
  TemporaryDirectory() {
    std::string pattern = (fs::temp_directory_path() / "sim_rig_test_XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~TemporaryDirectory() { fs::remove_all(path_); }
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  [[nodiscard]] fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

/// A conducted server in a thread, with a client's ends of line and conductor.
class Conducted {
 public:
  explicit Conducted(std::vector<PinEdge> script, const std::vector<std::string>& faults = {}) {
    ServerOptions options;
    options.link = directory_ / "pump";
    options.conductor = directory_ / "time";
    options.pins = directory_ / "pins.csv";
    options.faults = parse_rig_faults(faults);
    const auto description =
        read_rig_description(TableReader::from_text(default_rig_toml(), "the built-in rig file"));
    server_ = std::make_unique<Server>(description, std::make_unique<ScriptedController>(std::move(script)),
                                       options);
    EXPECT_EQ(::pipe(stop_.data()), 0);
    thread_ = std::thread([this] { server_->run(stop_[0]); });
    connect_conductor(options.conductor);
    open_line();
  }
  ~Conducted() {
    stop();
    ::close(line);
    ::close(conductor_);
    for (const int fd : stop_)
      ::close(fd);
  }
  Conducted(const Conducted&) = delete;
  Conducted& operator=(const Conducted&) = delete;

  void open_line() { line = ::open((directory_ / "pump").c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK); }

  void stop() {
    if (!thread_.joinable()) return;
    EXPECT_EQ(::write(stop_[1], "x", 1), 1);
    thread_.join();
  }

  conductor::Advanced ask(uint64_t until_ns, uint64_t written) const {
    conductor::Record record = conductor::encode(conductor::Advance{until_ns, written});
    EXPECT_EQ(::write(conductor_, record.data(), record.size()), 16);
    EXPECT_EQ(::recv(conductor_, record.data(), record.size(), MSG_WAITALL), 16);
    return conductor::decode_advanced(record);
  }

  [[nodiscard]] std::string pins() const {
    std::ifstream file(directory_ / "pins.csv");
    return {std::istreambuf_iterator<char>(file), {}};
  }

  int line = -1;

 private:
  void connect_conductor(const fs::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    conductor_ = ::socket(AF_UNIX, SOCK_STREAM, 0);
    ASSERT_EQ(::connect(conductor_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }

  TemporaryDirectory directory_;
  std::unique_ptr<Server> server_;
  std::array<int, 2> stop_{};
  std::thread thread_;
  int conductor_ = -1;
};

TEST(Server, TimeMovesOnlyWhenConducted) {
  Conducted rig({});
  EXPECT_EQ(rig.ask(0, 0), (conductor::Advanced{0, 0}));
  EXPECT_EQ(rig.ask(5'000'000, 0), (conductor::Advanced{5'000'000, 0}));
  EXPECT_EQ(rig.ask(3'000'000, 0), (conductor::Advanced{5'000'000, 0}));
}

TEST(Server, BytesWrittenBeforeAQuestionAreTakenBeforeTimeMoves) {
  Conducted rig({});
  ASSERT_EQ(::write(rig.line, "hello", 5), 5);
  EXPECT_EQ(rig.ask(1'000'000, 5), (conductor::Advanced{1'000'000, 5}));
  std::array<char, 16> echo{};
  pollfd readable{rig.line, POLLIN, 0};
  ASSERT_EQ(::poll(&readable, 1, 1000), 1);
  ASSERT_EQ(::read(rig.line, echo.data(), echo.size()), 5);
  EXPECT_STREQ(echo.data(), "hello");
}

TEST(Server, CountsStartAnewWhenThePortIsOpenedAgain) {
  Conducted rig({});
  ASSERT_EQ(::write(rig.line, "hello", 5), 5);
  EXPECT_EQ(rig.ask(1'000'000, 5).serial_bytes_sent_total, 5U);
  ::close(rig.line);
  rig.open_line();
  EXPECT_EQ(rig.ask(0, 0).serial_bytes_sent_total, 0U);
  ASSERT_EQ(::write(rig.line, "ab", 2), 2);
  EXPECT_EQ(rig.ask(2'000'000, 2).serial_bytes_sent_total, 2U);
}

TEST(Server, PinsAreTracedInOrderWithTheirTimes) {
  Conducted rig({{100, Pin::dir, 1}, {200, Pin::step, 1}, {300, Pin::step, 0}, {300, Pin::rwave_uV, 20000}});
  rig.ask(1'000'000, 0);
  rig.stop();
  EXPECT_EQ(rig.pins(), "time_ns,signal,value\n100,DIR,1\n200,STEP,1\n300,STEP,0\n300,RWAVE_uV,20000\n");
}

TEST(Server, AHangUpIsSeenAtTheLine) {
  Conducted rig({}, {"serial-hangup@0.002"});
  rig.ask(1'000'000, 0);
  pollfd state{rig.line, POLLIN, 0};
  EXPECT_EQ(::poll(&state, 1, 0), 0);
  EXPECT_EQ(rig.ask(3'000'000, 0).now_ns, 3'000'000U);
  ASSERT_EQ(::poll(&state, 1, 1000), 1);
  EXPECT_NE(state.revents & POLLHUP, 0);
}

TEST(Rig, PistonMotionAppearsAsVolts) {
  const auto description =
      read_rig_description(TableReader::from_text(default_rig_toml(), "the built-in rig file"));
  Rig rig(description, std::make_unique<ScriptedController>(home_and_inflate(2567, 200'000)),
          {.sent = [](std::span<const uint8_t>) {}, .edge = [](const PinEdge&) {}});
  rig.advance_to(30'000'000);
  EXPECT_NEAR(rig.volts(0) * description.channels[0].kPa_per_V, 0, 0.15);  // vented: noise only
  rig.advance_to(5'000'000'000);
  const GelAnnulus gel(description.plant.C1_kPa);
  EXPECT_NEAR(rig.volts(0) * description.channels[0].kPa_per_V, gel.pressure_kPa(20.0), 0.15);
  EXPECT_EQ(rig.volts(5), 0);
}

TEST(PtyLine, ALinkNeverReplacesAFile) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "file") << "precious";
  EXPECT_THROW(PtyLine(directory / "file"), InputError);
  EXPECT_TRUE(fs::is_regular_file(directory / "file"));
}

}  // namespace
}  // namespace diastole::sim_rig
