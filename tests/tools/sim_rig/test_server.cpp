#include <fcntl.h>
#include <gmock/gmock.h>
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
#include "tools/sim_rig/control_client.hpp"
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
  explicit Conducted(std::vector<sim_controller::PinEdge> script, const std::vector<std::string>& faults = {},
                     double host_drift_ppm = 0) {
    ServerOptions options;
    options.link = directory_ / "pump";
    options.conductor = directory_ / "time";
    options.pins = directory_ / "pins.csv";
    options.control = directory_ / "control";
    options.host_drift_ppm = host_drift_ppm;
    options.faults = parse_faults(faults);
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

  [[nodiscard]] std::string control() const { return directory_ / "control"; }

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
  Conducted rig({{100, sim_controller::Pin::dir, 1},
                 {200, sim_controller::Pin::step, 1},
                 {300, sim_controller::Pin::step, 0},
                 {300, sim_controller::Pin::rwave_uV, 20000}});
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

TEST(Server, ACableToTheScannerThatIsCutShowsInThePinTrace) {
  Conducted rig({{1'000'000, sim_controller::Pin::ttl, 1},
                 {2'000'000, sim_controller::Pin::ttl, 0},
                 {3'000'000, sim_controller::Pin::ttl, 1},
                 {3'000'000, sim_controller::Pin::rwave_uV, 9},
                 {4'000'000, sim_controller::Pin::step, 1},
                 {6'000'000, sim_controller::Pin::ttl, 0}},
                {"gate-lost@ttl+0.0015s:off@0.005"});
  rig.ask(7'000'000, 0);
  rig.stop();
  EXPECT_EQ(rig.pins(),
            "time_ns,signal,value\n1000000,TTL,1\n2000000,TTL,0\n4000000,STEP,1\n6000000,TTL,0\n");
}

TEST(Server, ALinePluggedInAgainIsThereUnderTheSameName) {
  Conducted rig({}, {"serial-hangup@0.002:off@0.004"});
  rig.ask(3'000'000, 0);
  ::close(rig.line);
  rig.ask(5'000'000, 0);
  rig.open_line();
  ASSERT_GE(rig.line, 0);
  EXPECT_EQ(rig.ask(0, 0).serial_bytes_sent_total, 0U);
  ASSERT_EQ(::write(rig.line, "ab", 2), 2);
  EXPECT_EQ(rig.ask(6'000'000, 2).serial_bytes_sent_total, 2U);
}

TEST(Server, ASilentLineSwallowsWhatIsSent) {
  Conducted rig({}, {"serial-silence@0.002"});
  ASSERT_EQ(::write(rig.line, "ab", 2), 2);
  EXPECT_EQ(rig.ask(1'000'000, 2).serial_bytes_sent_total, 2U);
  rig.ask(3'000'000, 2);
  ASSERT_EQ(::write(rig.line, "cd", 2), 2);
  EXPECT_EQ(rig.ask(5'000'000, 4).serial_bytes_sent_total, 2U);
}

TEST(Server, OrdersSwitchFaultsAndHoldTheTime) {
  Conducted rig({{1'000'000, sim_controller::Pin::ttl, 1}});
  ControlClient control(rig.control());
  EXPECT_EQ(nlohmann::json::parse(control.order("state"))["faults"], nlohmann::json::object());
  EXPECT_THAT(control.order("fault on leak 3"), testing::HasSubstr("leak on"));
  EXPECT_EQ(nlohmann::json::parse(control.order("state"))["faults"]["leak"], 3);
  control.order("fault off leak");
  EXPECT_EQ(nlohmann::json::parse(control.order("state"))["faults"], nlohmann::json::object());
  for (const char* order : {"fault on laek", "fault on estop 3", "fault on leak much", "fault", "dance",
                            "hold ttl", "fault on step-loss 2", "fault off leak 3"}) {
    EXPECT_THROW(control.order(order), InputError) << order;
  }
  control.order("hold 0.5");
  EXPECT_FALSE(control.held());
  std::thread conducting([&] { EXPECT_EQ(rig.ask(600'000'000, 0).now_ns, 600'000'000U); });
  while (!control.held())
    std::this_thread::yield();
  EXPECT_NEAR(nlohmann::json::parse(control.order("state"))["now_s"].get<double>(), 0.6, 1e-12);
  control.order("go");
  conducting.join();
}

TEST(Server, TimeGoesOnWhenItsHolderIsGone) {
  Conducted rig({});
  auto control = std::make_unique<ControlClient>(rig.control());
  control->order("hold 0.5");
  std::thread conducting([&] { EXPECT_EQ(rig.ask(600'000'000, 0).now_ns, 600'000'000U); });
  while (!control->held())
    std::this_thread::yield();
  control.reset();
  conducting.join();
}

TEST(Server, AHostWhoseClockRunsFastIsToldItsOwnTime) {
  Conducted rig({}, {}, 100);
  EXPECT_EQ(rig.ask(1'000'000'000, 0).now_ns, 1'000'000'000U);
  ControlClient control(rig.control());
  EXPECT_NEAR(nlohmann::json::parse(control.order("state"))["now_s"].get<double>(), 1 / 1.0001, 2e-8);
}

TEST(Rig, PistonMotionAppearsAsVolts) {
  const auto description =
      read_rig_description(TableReader::from_text(default_rig_toml(), "the built-in rig file"));
  Rig rig(description, std::make_unique<ScriptedController>(home_and_inflate(2567, 200'000)),
          {.sent = [](std::span<const uint8_t>) {}, .edge = [](const sim_controller::PinEdge&) {}});
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
  EXPECT_THROW(sim_controller::PtyLine(directory / "file"), InputError);
  EXPECT_TRUE(fs::is_regular_file(directory / "file"));
}

}  // namespace
}  // namespace diastole::sim_rig
