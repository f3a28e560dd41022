// Program link_faults between two pseudo-terminals: what a host sends through it comes to the controller's port,
// and the other way round.

#include <gmock/gmock.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <filesystem>
#include <thread>

#include "host/transport/serial_port.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/link_faults/proxy.hpp"
#include "tools/sim_controller/pty_line.hpp"

namespace diastole::link_faults {
namespace {

namespace fs = std::filesystem;

class Proxied : public testing::Test {
 protected:
  void SetUp() override {
    directory = fs::temp_directory_path() / ("link_faults-" + std::to_string(::getpid()));
    fs::create_directories(directory);
    controller = std::make_unique<sim_controller::PtyLine>(directory / "pump");
    options.port = (directory / "pump").string();
    options.link = (directory / "bad").string();
  }
  void TearDown() override {
    if (proxy.joinable()) end();
    ::close(stop);
    fs::remove_all(directory);
  }
  void start() {
    proxy = std::thread([this] {
      try {
        report = run_proxy(options, stop);
      } catch (const HardwareError& error) {
        problem = error.what();
      }
    });
    while (!fs::is_symlink(options.link))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    host = std::make_unique<SerialPort>(options.link, options.baud);
    std::this_thread::sleep_for(std::chrono::milliseconds(50));  // the proxy looks every 10 ms who is there
  }
  void end() {
    ::eventfd_write(stop, 1);
    proxy.join();
  }
  std::vector<uint8_t> heard_by_controller(size_t count) const {
    std::vector<uint8_t> heard;
    for (int i = 0; i < 2000 && heard.size() < count; ++i) {
      controller->refresh();
      const auto bytes = controller->read();
      heard.insert(heard.end(), bytes.begin(), bytes.end());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return heard;
  }

  fs::path directory;
  ProxyOptions options;
  std::unique_ptr<sim_controller::PtyLine> controller;
  std::unique_ptr<SerialPort> host;
  std::thread proxy;
  ProxyReport report;
  std::string problem;
  int stop = ::eventfd(0, EFD_CLOEXEC);
};

TEST_F(Proxied, AGoodLineCarriesBothWaysUnaltered) {
  start();
  const std::vector<uint8_t> request{5, 4, 3, 0, 7, 6, 0}, reply{9, 8, 0};
  host->write(request);
  EXPECT_EQ(heard_by_controller(request.size()), request);
  controller->write(reply);
  host->wait_received(reply.size(), 2000);
  std::vector<uint8_t> heard(16);
  heard.resize(host->read(heard));
  EXPECT_EQ(heard, reply);
  end();
  EXPECT_EQ(report.to_controller.frames, 2U);
  EXPECT_EQ(report.to_host.frames, 1U);
  EXPECT_THAT(to_text(report), testing::HasSubstr("to controller          2         0"));
}

TEST_F(Proxied, FaultsAreMadeAndTold) {
  options.to_controller.repetition = 1;
  start();
  const std::vector<uint8_t> request{5, 4, 0};
  host->write(request);
  EXPECT_EQ(heard_by_controller(6), (std::vector<uint8_t>{5, 4, 0, 5, 4, 0}));
  end();
  EXPECT_EQ(report.to_controller.repeated, 1U);
}

TEST_F(Proxied, ALostPortHangsTheHostUp) {
  start();
  controller->hang_up();
  proxy.join();
  EXPECT_THAT(problem, testing::HasSubstr("the serial port is gone"));
  std::array<uint8_t, 4> nothing{};
  (void)host->read(nothing);
  EXPECT_TRUE(host->lost());
}

}  // namespace
}  // namespace diastole::link_faults
