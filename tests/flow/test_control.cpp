// Who controls the rig: one lease, told by user and process, taken over by name only, and never silently.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pwd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <map>
#include <set>

#include "host/rpc/methods.hpp"
#include "host/transport/unix_socket.hpp"
#include "protocol/contract/input_error.hpp"
#include "tests/flow/rig_with_daemon.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::HasSubstr;

std::string own_name() { return ::getpwuid(::geteuid())->pw_name; }

/// What the daemon answers to these bytes, up to the end of the connection or of a line.
std::string answer_to(const std::string& socket, const std::string& bytes) {
  const Descriptor connection = connect_unix_socket(socket);
  (void)::send(connection.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
  std::string answer;
  for (char next = 0; ::read(connection.get(), &next, 1) == 1 && next != '\n';)
    answer += next;
  return answer;
}

TEST(Control, TheSecondClientIsToldWhoHoldsItAndTakesItOverByName) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto first = rig.client();
  first.call("rig.home");
  auto second = rig.client();
  EXPECT_EQ(second.call("rig.status")["control"]["pid"], ::getpid());
  EXPECT_THAT(message_of<HardwareError>([&] { second.call("rig.home"); }),
              AllOf(HasSubstr("controlled by " + own_name()), HasSubstr(std::to_string(::getpid())),
                    HasSubstr("--take-over")));
  EXPECT_THROW(second.call("control.take"), HardwareError);
  EXPECT_THROW(second.call("control.take", {{"take_over", "somebody-else"}}), HardwareError);
  EXPECT_EQ(second.call("control.take", {{"take_over", own_name()}})["user"], own_name());
  EXPECT_THROW(first.call("rig.home"), HardwareError) << "the lease is one";
  second.call("rig.home");
  EXPECT_TRUE(rig.daemon->wait_for_text("control was taken over from " + own_name())) << rig.daemon->err();
}

/// What needs no lease: it moves nothing and changes nothing, but for a stop.
const std::set<std::string_view> of_anybody{"rig.status", "rig.settings", "rig.black_box", "run.progress",
                                            "run.trace",  "run.continue", "run.stop"};

/// Orders that are carried out when whoever controls the rig gives them.
const std::map<std::string_view, json> orders{
    {"rig.home", json::object()},
    {"rig.zero", {{"seconds", 1}}},
    {"rig.calibrate", {{"channels", {"cavity"}}, {"kPa", 0.0}, {"seconds", 1}}},
    {"rig.clear_fault", json::object()},
    {"rig.jog", {{"mL", 1.0}, {"rate_mL_s", 5.0}}},
    {"rig.write_settings", {{"set", {{"backlash_um", 40}}}}},
    {"rig.self_test", {{"seconds", 2}}},
    {"run.start", many_segments()},
};

TEST(Control, EveryOrderOfASecondClientIsRefusedAndNothingMovesOrChanges) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto holder = rig.client();
  holder.call("rig.home");
  holder.call("rig.jog", {{"mL", 2.0}, {"rate_mL_s", 5.0}});
  const json settings = holder.call("rig.settings");
  const double position_mL = holder.call("rig.status")["position_mL"];
  const auto expect_untouched = [&](std::string_view after) {
    const json status = holder.call("rig.status");
    EXPECT_EQ(status["state"], "homed") << after;
    EXPECT_EQ(status["position_mL"], position_mL) << after;
    EXPECT_EQ(status["control"]["own"], true) << after;
    EXPECT_EQ(holder.call("rig.settings"), settings) << after;
  };
  for (const Method& method : methods()) {
    if (of_anybody.contains(method.name)) continue;
    ASSERT_TRUE(orders.contains(method.name)) << method.name << ": give an order of it";
    const json request{
        {"jsonrpc", "2.0"}, {"id", 1}, {"method", method.name}, {"params", orders.at(method.name)}};
    const json answer = json::parse(answer_to(rig.path("socket"), request.dump() + "\n"));
    EXPECT_EQ(answer.value("/error/code"_json_pointer, 0), -32003) << method.name << ": " << answer;
    expect_untouched(method.name);
  }
  rig.place.write("gel.experiment.toml", many_segments()["experiment"]);
  for (const std::vector<std::string>& command : std::vector<std::vector<std::string>>{
           {"home"},
           {"jog", "--mL", "1"},
           {"zero", "--seconds", "1"},
           {"calibrate", "cavity", "--kPa", "0", "--seconds", "1"},
           {"settings", "--set", "backlash_um=40"},
           {"selftest", "--seconds", "2"},
           {"run", "gel.experiment.toml", "-o", "gel.run.h5", "--no-questions"}}) {
    std::vector<std::string> whole{"diastole", command[0], "--socket", rig.path("socket")};
    whole.insert(whole.end(), command.begin() + 1, command.end());
    const Ended refused = run(rig.place, whole);
    EXPECT_EQ(refused.exit_code, 3) << command[0];
    EXPECT_THAT(refused.err, AllOf(HasSubstr("controlled by " + own_name()), HasSubstr("--take-over")))
        << command[0];
    expect_untouched(command[0]);
  }
  EXPECT_FALSE(std::filesystem::exists(rig.place / "gel.run.h5"));
  EXPECT_NEAR(holder.call("rig.jog", orders.at("rig.jog"))["position_mL"].get<double>(), position_mL + 1,
              0.01)
      << "the holder's order is carried out";
  holder.call("run.start", many_segments());
  holder.call("run.stop", {{"how", "halt"}});
  status_when(holder, "faulted", true);
  const Ended refused = run(rig.place, {"diastole", "clear-fault", "--socket", rig.path("socket")});
  EXPECT_EQ(refused.exit_code, 3) << refused.err;
  EXPECT_EQ(holder.call("rig.status")["state"], "faulted");
}

TEST(Control, ATakeoverDuringARunIsAnEventOfTheRun) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto first = rig.client();
  first.call("rig.home");
  const json begun = first.call("run.start", many_segments());
  auto second = rig.client();
  second.call("control.take", {{"take_over", own_name()}});
  second.call("run.stop", {{"how", "now"}});
  status_when(second, "homed", true);
  const Ended inspected =
      run(rig.place, {"diastole", "inspect", begun["run_file"].get<std::string>(), "--json"});
  const Ended reported = run(rig.place, {"diastole", "inspect", begun["run_file"].get<std::string>()});
  EXPECT_THAT(reported.out, HasSubstr("control_taken_over"));
  EXPECT_EQ(inspected.json()["stopped_on_request"], true);
}

TEST(Control, TheCommandTakesOverAndStatusTellsWho) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto first = rig.client();
  first.call("rig.home");
  const Ended refused = run(rig.place, {"diastole", "home", "--socket", rig.path("socket")});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_THAT(refused.err, HasSubstr("--take-over " + own_name()));
  const Ended status = run(rig.place, {"diastole", "status", "--socket", rig.path("socket")});
  EXPECT_THAT(status.out, HasSubstr("control   " + own_name()));
  const Ended takeover =
      run(rig.place, {"diastole", "home", "--socket", rig.path("socket"), "--take-over", own_name()});
  EXPECT_EQ(takeover.exit_code, 0) << takeover.err;
}

TEST(Control, AStrangerObservesAndStopsAndDoesNothingElse) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can become another user";
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  using std::filesystem::perms;
  const perms of_others = perms::group_read | perms::group_exec | perms::others_read | perms::others_exec;
  std::filesystem::permissions(rig.place.path(), perms::owner_all | of_others);
  rig.start_daemon();
  auto own = rig.client();
  own.call("rig.home");
  own.call("run.start", many_segments());
  const pid_t stranger = ::fork();
  if (stranger == 0) {
    if (::setgid(65534) != 0 || ::setuid(65534) != 0) ::_exit(9);
    const auto asked = [&](const std::string& method) {
      const std::string request = R"({"jsonrpc":"2.0","id":1,"params":{},"method":")" + method + "\"}\n";
      return json::parse(answer_to(rig.path("socket"), request));
    };
    if (!asked("rig.status").contains("result")) ::_exit(1);
    if (asked("rig.home")["error"]["code"] != -32005) ::_exit(2);
    if (asked("control.take")["error"]["code"] != -32005) ::_exit(3);
    if (asked("run.stop")["result"]["stopping"] != true) ::_exit(4);
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(stranger, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
  status_when(own, "homed", true);
}

TEST(Control, MalformedAndHugeMessagesAreAnsweredAndHalfOnesCostNothing) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  const std::string socket = rig.path("socket");
  const auto code_of = [&](const std::string& line) {
    return json::parse(answer_to(socket, line + "\n"))["error"]["code"].get<int>();
  };
  EXPECT_EQ(code_of("what?"), -32700);
  EXPECT_EQ(code_of(""), -32700);
  EXPECT_EQ(code_of(std::string("\0\xff\xfe", 3)), -32700);
  EXPECT_EQ(code_of("[]"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","method":"rig.status"})"), -32600);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"rig.explode"})"), -32601);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"run.stop","params":[]})"), -32602);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"run.stop","params":{"how":7}})"), -32602);
  EXPECT_EQ(code_of(R"({"jsonrpc":"2.0","id":1,"method":"run.progress","params":{"first_remark":"x"}})"),
            -32602);
  const auto code_of_number = [&](const char* method, const char* name, const char* number) {
    return code_of(fmt::format(R"({{"jsonrpc":"2.0","id":1,"method":"{}","params":{{"{}":{}}}}})", method,
                               name, number));
  };
  for (const char* number : {"-1", "-1.0", "1.5", "1e300", "null"}) {
    EXPECT_EQ(code_of_number("run.progress", "first_remark", number), -32602) << number;
    EXPECT_EQ(code_of_number("run.trace", "first_row", number), -32602) << number;
    EXPECT_EQ(code_of_number("run.trace", "first_trigger", number), -32602) << number;
    EXPECT_EQ(code_of_number("run.continue", "slice", number), -32602) << number;
  }
  EXPECT_EQ(code_of_number("rig.jog", "rate_mL_s\":1,\"mL", "null"), -32602);
  EXPECT_EQ(code_of_number("rig.jog", "mL\":1,\"rate_mL_s", "null"), -32602);
  EXPECT_EQ(code_of(std::string(900'000, '[')), -32700);
  EXPECT_THAT(answer_to(socket, std::string(1'100'000, 'x')), HasSubstr("a line has at most"));
  const Descriptor half = connect_unix_socket(socket);
  (void)::send(half.get(), "{\"jsonrpc\"", 10, MSG_NOSIGNAL);
  EXPECT_EQ(home(*std::make_unique<DaemonClient>(socket))["state"], "homed");
}

TEST(Control, WhoClosesItsHalfStillGetsItsAnswer) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  const Descriptor connection = connect_unix_socket(rig.path("socket"));
  const std::string request = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"rig.status\"}\n";
  (void)::send(connection.get(), request.data(), request.size(), MSG_NOSIGNAL);
  ::shutdown(connection.get(), SHUT_WR);
  std::string answer;
  for (char next = 0; ::read(connection.get(), &next, 1) == 1;)
    answer += next;
  EXPECT_THAT(answer, HasSubstr("\"state\""));
}

TEST(Control, WhoDoesNotReadItsAnswersIsDroppedAndTheLogTells) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  const Descriptor connection = connect_unix_socket(rig.path("socket"));
  const std::string request = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"rig.status\"}\n";
  while (::send(connection.get(), request.data(), request.size(), MSG_NOSIGNAL) > 0) {
  }
  EXPECT_TRUE(rig.daemon->wait_for_text("does not read its answers")) << rig.daemon->err();
  auto other = rig.client();
  EXPECT_EQ(home(other)["state"], "homed");
}

TEST(Control, MoreConnectionsThanThereIsRoomForPushTheSilentOut) {
  RigWithDaemon rig(RigWithDaemon::Time::conducted);
  rig.start_daemon();
  auto holder = rig.client();
  holder.call("rig.home");
  std::vector<Descriptor> silent;
  for (int i = 0; i < 300; ++i)
    silent.push_back(connect_unix_socket(rig.path("socket")));
  auto late = rig.client();
  EXPECT_EQ(late.call("rig.status")["control"]["pid"], ::getpid());
  holder.call("rig.home");
}

}  // namespace
}  // namespace diastole::flow
