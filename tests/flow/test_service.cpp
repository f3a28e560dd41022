// The daemon as a service: what it tells its supervisor, and that the watchdog is fed by the loop that does the
// work.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <csignal>

#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::flow {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

/// systemd's end of NOTIFY_SOCKET.
class Supervisor {
 public:
  explicit Supervisor(const std::string& path) : socket_(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(::bind(socket_.get(), reinterpret_cast<sockaddr*>(&address), sizeof(address)), 0);
  }
  /// The first line of the next word; empty if none comes for `timeout`.
  std::string next(std::chrono::milliseconds timeout) {
    pollfd state{socket_.get(), POLLIN, 0};
    if (::poll(&state, 1, static_cast<int>(timeout.count())) <= 0) return "";
    std::array<char, 512> text{};
    const ssize_t size = ::recv(socket_.get(), text.data(), text.size(), 0);
    const std::string word(text.data(), static_cast<size_t>(std::max<ssize_t>(0, size)));
    return word.substr(0, word.find('\n'));
  }
  /// Reads on to the word; false if it does not come for `timeout`.
  bool hears(const std::string& word, std::chrono::milliseconds timeout) {
    for (std::string heard = next(timeout); !heard.empty(); heard = next(timeout))
      if (heard == word) return true;
    return false;
  }
  /// Reads on until nothing comes for `silence`; false if that does not happen within `timeout`.
  bool falls_silent(std::chrono::milliseconds silence, std::chrono::milliseconds timeout) {
    for (const auto end = std::chrono::steady_clock::now() + timeout; std::chrono::steady_clock::now() < end;)
      if (next(silence).empty()) return true;
    return false;
  }

 private:
  Descriptor socket_;
};

std::vector<std::string> supervised(const RigWithDaemon& rig, const std::string& watchdog_us) {
  return {"/usr/bin/env", "NOTIFY_SOCKET=" + rig.path("notify"), "WATCHDOG_USEC=" + watchdog_us};
}

class Service : public testing::TestWithParam<RigWithDaemon::Time> {};

TEST_P(Service, ReadyThenAliveThenStopping) {
  RigWithDaemon rig(GetParam());
  Supervisor supervisor(rig.path("notify"));
  rig.start_daemon(supervised(rig, "400000"));
  EXPECT_TRUE(supervisor.hears("READY=1", 20s));
  for (int beat = 0; beat < 4; ++beat)
    EXPECT_TRUE(supervisor.hears("WATCHDOG=1", 20s));
  rig.daemon->signal(SIGTERM);
  EXPECT_TRUE(supervisor.hears("STOPPING=1", 20s));
  EXPECT_EQ(rig.daemon->wait().exit_code, 0);
  rig.daemon.reset();
}

INSTANTIATE_TEST_SUITE_P(Daemon, Service,
                         testing::Values(RigWithDaemon::Time::conducted, RigWithDaemon::Time::real),
                         [](const auto& each) {
                           return each.param == RigWithDaemon::Time::real ? "RealTime" : "ConductedTime";
                         });

TEST(Service, ALoopThatHangsIsNotAliveHoweverTheServerAnswers) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  Supervisor supervisor(rig.path("notify"));
  rig.start_daemon(supervised(rig, "400000"));
  auto client = rig.client();
  home(client);
  client.call("run.start", many_segments());
  EXPECT_TRUE(supervisor.hears("WATCHDOG=1", 20s));
  rig.rig().signal(SIGSTOP);  // time does not go on: the loop waits for it for ever
  EXPECT_TRUE(supervisor.falls_silent(400ms, 20s));
  EXPECT_EQ(client.call("run.progress")["state"], "running") << "the server must still answer";
  EXPECT_FALSE(supervisor.hears("WATCHDOG=1", 1000ms));
  rig.rig().signal(SIGCONT);
  EXPECT_TRUE(supervisor.hears("WATCHDOG=1", 20s));
  client.call("run.stop", {{"how", "now"}});
}

TEST(Service, AJournalGetsLevelsInsteadOfTimes) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon({"/bin/sh", "-c", "JOURNAL_STREAM=$(stat -L -c %d:%i /dev/stderr) exec \"$0\" \"$@\""});
  EXPECT_TRUE(rig.daemon->wait_for_text("<6>controller at ")) << rig.daemon->err();
}

}  // namespace
}  // namespace diastole::flow
