// The web console's endpoint, and that the same rules hold there as at the socket.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <thread>

#include "protocol/contract/input_error.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/flow/web_client.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

struct RigWithConsole : RigWithDaemon {
  RigWithConsole() : RigWithDaemon(Time::conducted) {
    daemon_options = {"--console", "127.0.0.1:0"};
    start_daemon();
    const json console = json::parse(daemon->out())["console"];
    const std::string url = console["control"];
    const size_t colon = url.rfind(':');
    port = std::stoi(url.substr(colon + 1));
    control = url.substr(url.find("token=") + 6);
    watch = console["watch"].get<std::string>().substr(url.find("token=") + 6);
  }
  /// An open console at which `name` has signed in.
  std::unique_ptr<WebClient> console(const std::string& name = "", const std::string& token = "") const {
    auto client = std::make_unique<WebClient>(port);
    EXPECT_EQ(client->upgrade(token.empty() ? control : token).status, 101);
    if (!name.empty()) {
      EXPECT_EQ(client->call("console.sign_in", {{"name", name}})["result"]["user"], name);
    }
    return client;
  }
  int port = 0;
  std::string control;  ///< token
  std::string watch;
};

int code_in(const json& answer) { return answer["error"]["code"]; }

TEST(Console, OnlyAnOwnPlaceAndAValidTokenOpenTheDoor) {
  const RigWithConsole rig;
  const auto get = [&](const std::string& path, const std::vector<std::string>& headers = {},
                       const char* host = "") { return WebClient(rig.port).get(path, headers, host); };
  const WebAnswer page = get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_THAT(page.headers,
              AllOf(HasSubstr("Content-Security-Policy: default-src 'none'"), HasSubstr("no-store"),
                    HasSubstr("frame-ancestors 'none'"), HasSubstr("nosniff")));
  EXPECT_THAT(page.body, AllOf(HasSubstr("<title>Diastole console"), testing::Not(HasSubstr(rig.control))));
  EXPECT_EQ(get("/role", {"Authorization: Bearer " + rig.control}).body, R"({"role":"control"})");
  EXPECT_EQ(get("/role", {"Authorization: Bearer " + rig.watch}).body, R"({"role":"watch"})");
  for (const std::string& token :
       {std::string(), std::string("0"), std::string(32, 'a'), rig.control.substr(1)}) {
    const WebAnswer refused = WebClient(rig.port).upgrade(token);
    EXPECT_EQ(refused.status, 401) << token;
    EXPECT_THAT(refused.body, HasSubstr("diastole console"));
    EXPECT_EQ(get("/role", {"Authorization: Bearer " + token}).status, 401);
  }
  EXPECT_EQ(get("/", {}, "evil.example").status, 403);
  EXPECT_EQ(WebClient(rig.port).upgrade(rig.control, {"Origin: http://evil.example"}).status, 403);
  EXPECT_EQ(WebClient(rig.port)
                .upgrade(rig.control, {"Origin: http://127.0.0.1:" + std::to_string(rig.port)})
                .status,
            101);
  EXPECT_EQ(get("/rpc", {"Authorization: Bearer " + rig.control}).status, 426);
  EXPECT_EQ(get("/rig.toml").status, 404);
  EXPECT_TRUE(rig.daemon->wait_for_text("without a valid token")) << rig.daemon->err();
  EXPECT_THAT(rig.daemon->err(), testing::Not(HasSubstr(rig.control)));
}

TEST(Console, WhatIsNoRequestIsAnsweredAndCostsNothing) {
  const RigWithConsole rig;
  const auto status_of = [&](const std::string& bytes) {
    WebClient client(rig.port);
    client.send(bytes);
    return client.read_answer().status;
  };
  EXPECT_EQ(status_of("what?\r\n\r\n"), 400);
  EXPECT_EQ(status_of(std::string("\0\xff\xfe\r\n\r\n", 7)), 400);
  EXPECT_EQ(status_of("POST / HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 0\r\n\r\n"), 405);
  EXPECT_EQ(status_of("GET / HTTP/1.1\r\n\r\n"), 403);
  EXPECT_EQ(status_of("GET / HTTP/1.1\r\nX: " + std::string(10'000, 'x')), 400);
  EXPECT_EQ(status_of("GET /rpc HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 900000000\r\n\r\n"), 400);
  EXPECT_EQ(WebClient(rig.port).get("/").status, 200);
}

TEST(Console, TheSameLeaseHoldsAtBothDoors) {
  RigWithConsole rig;
  auto socket = rig.client();
  socket.call("rig.home");
  const auto console = rig.console();
  EXPECT_THAT(console->call("rig.home")["error"]["message"], HasSubstr("say who you are"));
  EXPECT_EQ(code_in(console->call("console.sign_in", {{"name", "two\nlines"}})), -32602);
  console->call("console.sign_in", {{"name", "anna"}});
  const json refused = console->call("rig.home");
  EXPECT_EQ(code_in(refused), -32003);
  EXPECT_EQ(refused["error"]["data"]["pid"], ::getpid());
  EXPECT_EQ(code_in(console->call("control.take", {{"take_over", "somebody-else"}})), -32003);
  const std::string own_name = ::getpwuid(::geteuid())->pw_name;
  EXPECT_EQ(console->call("control.take", {{"take_over", own_name}})["result"]["user"], "anna");
  EXPECT_EQ(console->call("rig.status")["result"]["control"]["own"], true);
  EXPECT_THAT(message_of<HardwareError>([&] { socket.call("rig.home"); }),
              AllOf(HasSubstr("anna (console at 127.0.0.1)"), HasSubstr("--take-over anna")));
  EXPECT_THAT(run(rig.place, {"diastole", "status", "--socket", rig.path("socket")}).out,
              HasSubstr("control   anna (console at 127.0.0.1)"));
  EXPECT_EQ(code_in(console->call("console.sign_in", {{"name", "ben"}})), -32005) << "while she controls";
  EXPECT_THROW(socket.call("control.take", {{"take_over", "0"}}), HardwareError)
      << "a console has no process";
  socket.call("control.take", {{"take_over", "anna"}});
  EXPECT_EQ(code_in(console->call("rig.home")), -32003);
  EXPECT_TRUE(
      rig.daemon->wait_for_text("control was taken over from anna (console at 127.0.0.1) by " + own_name))
      << rig.daemon->err();
}

TEST(Console, AConsoleThatClosesLeavesTheControl) {
  RigWithConsole rig;
  auto anna = rig.console("anna");
  EXPECT_EQ(anna->call("rig.home")["result"]["state"], "homed");
  const auto ben = rig.console("ben");
  EXPECT_THAT(ben->call("rig.home")["error"]["message"], HasSubstr("controlled by anna"));
  anna.reset();
  auto socket = rig.client();
  while (!socket.call("rig.status")["control"].is_null()) {
  }
  EXPECT_EQ(ben->call("rig.home")["result"]["state"], "homed");
}

TEST(Console, AWatchTokenObservesAndStopsAndDoesNothingElse) {
  RigWithConsole rig;
  const auto anna = rig.console("anna");
  anna->call("rig.home");
  const std::string hours =
      "format = \"diastole-experiment\"\nversion = 1\nrest_s = 0.2\n"
      "[[segment]]\nwaveform = \"parabolic\"\nstroke_mL = 2.0\nperiod_s = 0.3\ncycles = 50000\n";
  EXPECT_TRUE(
      anna->call("run.start", {{"experiment", hours}, {"file", "hours.experiment.toml"}}).contains("result"));
  const auto onlooker = rig.console("otto", rig.watch);
  EXPECT_EQ(onlooker->call("rig.status")["result"]["control"]["user"], "anna");
  EXPECT_EQ(code_in(onlooker->call("control.take", {{"take_over", "anna"}})), -32005);
  EXPECT_EQ(code_in(onlooker->call("console.address")), -32005);
  EXPECT_EQ(onlooker->call("run.stop")["result"]["stopping"], true);
  auto socket = rig.client();
  status_when(socket, "homed", true);
}

TEST(Console, WhatIsSeenOfARunIsItsPressureItsTriggersAndItsEvents) {
  RigWithConsole rig;
  const auto anna = rig.console("anna");
  anna->call("rig.home");
  const json begun = anna->call("run.start", many_segments())["result"];
  auto socket = rig.client();
  status_when(socket, "homed", true);
  const json progress = anna->call("run.progress")["result"];
  EXPECT_EQ(progress["triggers"], 60);
  EXPECT_TRUE(progress["gate_pulses"].is_null());
  json columns = anna->call("run.trace")["result"];
  EXPECT_EQ(columns["run_id"], begun["run_id"]);
  EXPECT_EQ(columns["trigger_s"].size(), 60U);
  size_t rows = 0;
  for (; !columns["time_s"].empty();
       columns = anna->call("run.trace", {{"run_id", begun["run_id"]}, {"first_row", rows}})["result"]) {
    EXPECT_EQ(columns["first_row"], rows);
    EXPECT_EQ(columns["time_s"].size(), columns["kPa"].size());
    rows += columns["time_s"].size();
  }
  EXPECT_EQ(rows, progress["received"]);
}

TEST(Console, MalformedMessagesAreAnsweredAndBrokenFramesEndTheConnection) {
  RigWithConsole rig;
  const auto console = rig.console();
  const auto code_of = [&](std::string_view text) {
    console->send_text(text);
    return code_in(json::parse(console->receive()));
  };
  EXPECT_EQ(code_of("what?"), -32700);
  EXPECT_EQ(code_of(""), -32700);
  EXPECT_EQ(code_of("[]"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"rig.explode"})"), -32601);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"run.trace","params":{"first_row":"x"}})"), -32602);
  EXPECT_EQ(code_of(std::string(900'000, '[')), -32700);
  console->send_frame(1, R"({"jsonrpc":"2.0","id":1,)", false);
  console->send_frame(9, "still there?");
  console->send_frame(0, R"("method":"rig.status"})");
  EXPECT_TRUE(json::parse(console->receive()).contains("result")) << "a message in two frames";
  const auto ends = [&](const auto& attack) {
    const auto hostile = rig.console();
    attack(*hostile);
    return hostile->receive().empty();
  };
  EXPECT_TRUE(ends([](WebClient& client) { client.send_text(std::string(1'100'000, 'x')); }));
  EXPECT_TRUE(rig.daemon->wait_for_text("sent a message longer than")) << rig.daemon->err();
  EXPECT_TRUE(ends([](WebClient& client) { client.send_text("\xff\xfe"); })) << "no UTF-8";
  EXPECT_TRUE(ends([](WebClient& client) { client.send_frame(5, "an opcode that there is not"); }));
  EXPECT_TRUE(ends([](WebClient& client) { client.send(std::string("\x81\x01x", 3)); })) << "not masked";
  EXPECT_TRUE(ends([](WebClient& client) { client.send_frame(0, "goes on with nothing"); }));
  EXPECT_TRUE(ends([](WebClient& client) {
    client.send(std::string("\x81\xff\xff\xff\xff\xff\xff\xff\xff\xff\0\0\0\0", 14));
  }));
  EXPECT_TRUE(console->call("rig.status").contains("result"));
}

TEST(Console, WhoDoesNotReadIsDroppedAndTheLogTells) {
  RigWithConsole rig;
  auto socket = rig.client();
  home(socket);
  socket.call("run.start", many_segments());
  status_when(socket, "homed", true);
  WebClient lazy(rig.port, true);
  EXPECT_EQ(lazy.upgrade(rig.control).status, 101);
  while (lazy.send_text(R"({"jsonrpc":"2.0","id":1,"method":"run.trace"})")) {
  }
  EXPECT_TRUE(rig.daemon->wait_for_text("does not read its answers")) << rig.daemon->err();
  EXPECT_EQ(socket.call("rig.home")["state"], "homed");
}

TEST(Console, ManyIdleBrowsersPushNoConsoleOut) {
  RigWithConsole rig;
  const auto anna = rig.console("anna");
  std::vector<std::unique_ptr<WebClient>> idle;
  for (int i = 0; i < 40; ++i)
    idle.push_back(std::make_unique<WebClient>(rig.port));
  EXPECT_EQ(WebClient(rig.port).get("/").status, 200);
  EXPECT_EQ(idle.front()->read_answer().status, 0) << "the oldest gave way";
  std::vector<std::unique_ptr<WebClient>> consoles;
  for (int i = 1; i < 16; ++i)
    consoles.push_back(rig.console());
  const WebAnswer refused = WebClient(rig.port).upgrade(rig.control);
  EXPECT_EQ(refused.status, 503);
  EXPECT_THAT(refused.body, HasSubstr("16 consoles are open"));
  EXPECT_EQ(anna->call("rig.home")["result"]["state"], "homed");
}

TEST(Console, TheCommandTellsTheAddressesToWhoMayControl) {
  RigWithConsole rig;
  const Ended reported = run(rig.place, {"diastole", "console", "--socket", rig.path("socket")});
  EXPECT_EQ(reported.exit_code, 0) << reported.err;
  EXPECT_THAT(reported.out, AllOf(HasSubstr("/#token=" + rig.control), HasSubstr("/#token=" + rig.watch)));
  EXPECT_EQ(code_in(rig.console("anna")->call("console.address")), -32005);
}

TEST(Console, BeyondThisMachineItIsEncryptedAndKnownByItsFingerprint) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.daemon_options = {"--console", "0.0.0.0:0"};
  std::string fingerprint;
  for (int start = 0; start < 2; ++start) {
    rig.start_daemon();
    const json console = json::parse(rig.daemon->out())["console"];
    const std::string url = console["control"];
    EXPECT_THAT(url, testing::StartsWith("https://"));
    if (start == 0) fingerprint = console["fingerprint"];
    EXPECT_EQ(console["fingerprint"], fingerprint) << "another certificate at the second start";
    EXPECT_THAT(rig.daemon->err(), HasSubstr(fingerprint));
    const std::string port = url.substr(url.rfind(':') + 1, url.find("/#") - url.rfind(':') - 1);
    const Ended browser =
        run(rig.place,
            {"/usr/bin/python3", "-B", std::string(DIASTOLE_SOURCE_DIR) + "/tests/flow/console_over_tls.py",
             port, url.substr(url.find("token=") + 6), fingerprint});
    EXPECT_EQ(browser.exit_code, 0) << browser.err;
    EXPECT_THAT(browser.out, HasSubstr("\"state\":\"unhomed\""));
    EXPECT_THAT(run(rig.place, {"diastole", "console", "--socket", rig.path("socket")}).out,
                HasSubstr(fingerprint));
    rig.daemon->signal(SIGTERM);
    EXPECT_EQ(rig.daemon->wait().exit_code, 0);
    rig.daemon.reset();
  }
  const auto file = std::filesystem::status(rig.place / "journals/console-certificate.pem");
  EXPECT_EQ(file.permissions() & std::filesystem::perms::all,
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST(Console, ObserversWhoReadTheBlackBoxDisturbNobody) {
  RigWithConsole rig;
  auto anna = rig.console("anna");
  EXPECT_EQ(anna->call("rig.home")["result"]["state"], "homed");
  std::atomic<bool> over = false;
  std::atomic<int> read = 0, refused = 0;
  std::vector<std::jthread> observers;
  for (int i = 0; i < 4; ++i) {
    observers.emplace_back([&] {
      auto client = rig.client();
      while (!over) {
        try {
          read += client.call("rig.black_box").contains("entries") ? 1 : 0;
        } catch (const HardwareError&) {
          ++refused;  // while a run is on
        }
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    });
  }
  while (read < 4)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  const auto asked = std::chrono::steady_clock::now();
  EXPECT_TRUE(anna->call("run.start", many_segments()).contains("result"));
  EXPECT_LT(std::chrono::steady_clock::now() - asked, std::chrono::seconds(20));
  json progress;
  do {
    progress = anna->call("run.progress")["result"];
  } while (progress["state"] == "running" || progress["state"] == "writing");
  over = true;
  observers.clear();
  EXPECT_EQ(progress["state"], "done");
  EXPECT_EQ(progress["missing"], 0);
  EXPECT_EQ(progress["triggers"], 60);
  EXPECT_GT(refused, 0);
}

TEST(Console, WithoutTheOptionThereIsNone) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  EXPECT_FALSE(json::parse(rig.daemon->out()).contains("console"));
  const Ended reported = run(rig.place, {"diastole", "console", "--socket", rig.path("socket")});
  EXPECT_EQ(reported.exit_code, 1);
  EXPECT_THAT(reported.out, HasSubstr("start it with --console"));
}

}  // namespace
}  // namespace diastole::flow
