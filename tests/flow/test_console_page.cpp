// The console's page in a real browser, at a simulated rig: sign in, home, start, look on, stop, and what it says when
// something is wrong. The screenshots go to the directory that DIASTOLE_SCREENSHOTS names, if it does.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>

#include "tests/flow/browser.hpp"
#include "tests/flow/rig_with_daemon.hpp"

namespace diastole::flow {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr const char* session = R"(format = "diastole-experiment"
version = 1
rest_s = 0.3
[[segment]]
waveform = "parabolic"
stroke_mL = 40.0
period_s = 1.2
cycles = 500
)";

class ConsolePage : public testing::Test {
 protected:
  void SetUp() override {
    if (Browser::program().empty())
      GTEST_SKIP() << "this machine has no Chromium: apt install chromium-headless-shell";
  }
  /// A rig in real time whose instrument falls silent for a while, and a page that has come to the console.
  void begin() {
    rig = std::make_unique<RigWithDaemon>(RigWithDaemon::Time::real, source_text("examples/rig.toml"),
                                          std::vector<std::string>{"--fault", "daq-stall@ttl+2+0.3"});
    rig->daemon_options = {"--console", "127.0.0.1:0"};
    rig->start_daemon();
    const std::string url = json::parse(rig->daemon->out())["console"]["control"];
    base = url.substr(0, url.find('#'));
    browser = std::make_unique<Browser>(rig->place, 1280, 800);
    browser->open(url);
  }
  void click(const std::string& id) { browser->value("document.getElementById('" + id + "').click()"); }
  void wait_for(const std::string& id, const std::string& text) {
    browser->wait_until("document.getElementById('" + id + "').textContent.includes(" + json(text).dump() +
                        ")");
  }
  void begin_in_control() {
    begin();
    wait_for("state", "Not homed");
    click("take");
    fill_in("name", "anna");
    click("name-now");
    wait_for("control-text", "control: you");
  }
  std::string text_of(const std::string& id) {
    return browser->value("document.getElementById('" + id + "').textContent");
  }
  void fill_in(const std::string& id, const std::string& text) {
    browser->value("document.getElementById('" + id + "').value = " + json(text).dump());
  }
  void screenshot(const std::string& name) {
    if (const char* directory = std::getenv("DIASTOLE_SCREENSHOTS"))
      browser->screenshot(std::string(directory) + "/" + name);
  }

  std::unique_ptr<RigWithDaemon> rig;
  std::unique_ptr<Browser> browser;
  std::string base;
};

TEST_F(ConsolePage, ASessionFromSigningInToTheFaultAndBack) {
  begin();
  wait_for("state", "Not homed");
  EXPECT_EQ(browser->value("location.hash"), "") << "the token is taken out of sight";
  click("home");
  fill_in("name", "anna");
  click("name-now");
  wait_for("state", "Ready");
  wait_for("control-text", "anna · control: you");

  // An experiment that cannot be is refused with its place, its value and the remedy, and nothing moves.
  click("start");
  fill_in("experiment", with(session, "stroke_mL = 40.0", "stroke_mL = 4000000.0"));
  click("start-now");
  wait_for("start-problem", "stroke_mL");
  screenshot("console-refused.png");
  browser->choose_files("#files", {rig->path(rig->place.write("gel.experiment.toml", session))});
  wait_for("files-text", "gel.experiment.toml");
  browser->wait_until("document.getElementById('experiment').value.includes('cycles = 500')");
  click("start-now");
  wait_for("state", "Running");

  // The trace grows, triggers are counted, and the instrument's silence is told.
  browser->wait_until("document.querySelector('#chart canvas')");
  browser->wait_until("Number(document.getElementById('triggers').textContent) >= 3");
  wait_for("missing-note", "see the events");
  wait_for("events", "samples are missing");
  EXPECT_EQ(browser->value("document.getElementById('box-missing').classList.contains('bad')"), true);
  if (std::getenv("DIASTOLE_SCREENSHOTS") != nullptr)
    browser->wait_until("Number(document.getElementById('triggers').textContent) >= 13");
  screenshot("console.png");

  browser->press("Escape");
  wait_for("state", "Ready");
  wait_for("state-detail", "stopped now");
  wait_for("events", "controlled stop was asked for");

  // A halt latches a fault: it is told with its remedy, and cleared.
  click("start");
  click("start-now");
  browser->wait_until("document.body.dataset.state == 'running'");
  click("halt");
  click("halt-now");
  wait_for("fault-title", "Fault 6");
  wait_for("fault-remedy", "home");
  screenshot("console-fault.png");
  browser->wait_until("!document.getElementById('clear').disabled");
  click("clear");
  wait_for("state", "Not homed");

  EXPECT_THAT(browser->complaints(), testing::IsEmpty());
  for (const std::string& each : browser->requested_urls())
    EXPECT_THAT(each.substr(each.find("://")), testing::StartsWith(base.substr(base.find("://"))));
}

TEST_F(ConsolePage, WithoutTheDaemonWhatIsShownIsStaleAtOnceAndAWrongTokenIsTold) {
  begin();
  wait_for("state", "Not homed");
  browser->wait_until("!document.body.classList.contains('stale')");
  ::kill(rig->daemon->pid(), SIGSTOP);
  browser->wait_until("document.body.classList.contains('stale')");
  EXPECT_EQ(browser->value("document.getElementById('lost').hidden"), false);
  EXPECT_EQ(text_of("link-text"), "not connected");
  screenshot("console-lost.png");
  ::kill(rig->daemon->pid(), SIGCONT);
  browser->wait_until("!document.body.classList.contains('stale')");
  browser->open(base + "?again#token=wrong");
  wait_for("lost-text", "diastole console");
}

TEST_F(ConsolePage, AStopThatNobodyConfirmsSaysSoAtOnceWhateverIsShown) {
  begin();
  wait_for("state", "Not homed");
  ::kill(rig->daemon->pid(), SIGSTOP);
  browser->wait_until("document.body.classList.contains('stale')");
  // By the page's own clock, from the key to the dialog.
  browser->value(
      "{ document.addEventListener('keydown', () => { window.asked_ms = performance.now(); }, true); "
      "new MutationObserver(() => { window.told_ms = window.told_ms || performance.now(); })"
      ".observe(document.getElementById('problem-dialog'), { attributeFilter: ['open'] }); }");
  browser->press("Escape");
  wait_for("problem-title", "The daemon has not confirmed the stop: press the emergency stop");
  EXPECT_EQ(browser->value("document.getElementById('problem-dialog').open"), true);
  EXPECT_LT(browser->value("window.told_ms - window.asked_ms").get<double>(), 1000);
  ::kill(rig->daemon->pid(), SIGCONT);
}

TEST_F(ConsolePage, APageThatTheBrowserLetsSleepKeepsItsConnectionAndItsControl) {
  begin_in_control();
  // Its timers come a minute late, at a moment when an answer is still on its way.
  ::kill(rig->daemon->pid(), SIGSTOP);
  browser->value("{ const now = performance.now.bind(performance); performance.now = () => now() + 60000; }");
  browser->wait_until("document.body.classList.contains('stale')");
  ::kill(rig->daemon->pid(), SIGCONT);
  browser->wait_until("!document.body.classList.contains('stale')");
  wait_for("control-text", "control: you");
  size_t connections = 0;
  for (const std::string& each : browser->requested_urls())
    connections += each.starts_with("ws://") ? 1 : 0;
  EXPECT_EQ(connections, 1U);
}

TEST_F(ConsolePage, WhoLosesTheControlIsTold) {
  begin_in_control();
  click("release");
  wait_for("control-text", "control: free");
  EXPECT_EQ(browser->value("document.getElementById('problem-dialog').open"), false) << "let go by herself";
  click("take");
  wait_for("control-text", "control: you");
  DaemonClient other = rig->client();
  other.call("control.take", {{"take_over", "anna"}});
  wait_for("problem-title", "You no longer control the rig");
  EXPECT_EQ(browser->value("document.getElementById('problem-dialog').open"), true);
}

TEST_F(ConsolePage, ABrowserThatSleptLongerThanThePingsLastIsToldThatItLostTheControl) {
  begin_in_control();
  browser->pause(12);
  EXPECT_TRUE(rig->client().call("rig.status")["control"].is_null())
      << "the control ended with the connection";
  wait_for("problem-title", "You no longer control the rig");
  wait_for("control-text", "control: free");
}

TEST_F(ConsolePage, WhatTheDaemonCannotTellIsShownAsUnknown) {
  begin();
  wait_for("control-text", "control: free");
  ::kill(rig->rig().pid(), SIGSTOP);
  wait_for("state", "Not there");
  wait_for("control-text", "control: unknown");
  ::kill(rig->rig().pid(), SIGCONT);
  wait_for("control-text", "control: free");
}

TEST_F(ConsolePage, AnArmedControllerTakesOrders) {
  begin();
  wait_for("state", "Not homed");
  EXPECT_EQ(browser->value("document.getElementById('start').disabled"), true);
  browser->value(
      "{ const parse = JSON.parse; JSON.parse = (text) => "
      "parse(text.replace('\"state\":\"unhomed\"', '\"state\":\"armed\"')); }");
  wait_for("state", "Armed");
  for (const char* id : {"start", "home"})
    EXPECT_EQ(browser->value(std::string("document.getElementById('") + id + "').disabled"), false) << id;
}

TEST_F(ConsolePage, ABrowserThatHasEndedIsToldAndEndsNobodyElse) {
  begin();
  browser->close();
  EXPECT_THROW(browser->value("1"), std::runtime_error);
}

}  // namespace
}  // namespace diastole::flow
