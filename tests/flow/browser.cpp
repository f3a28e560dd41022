#include "tests/flow/browser.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <thread>

namespace diastole::flow {
namespace {

using nlohmann::json;
using namespace std::chrono_literals;

constexpr int answer_timeout_ms = 60'000;

/// As DevTools sends pictures.
std::string from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char each : text) {
    const size_t digit = digits.find(each);
    if (digit == std::string::npos) break;
    bits = bits << 6 | static_cast<unsigned>(digit);
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 0xFF);
  }
  return bytes;
}

[[noreturn]] void become(const std::string& program, const std::string& profile, int commands, int answers,
                         const std::string& log) {
  // The protocol's ends are descriptors 3 and 4; they may be each other's numbers now.
  const int from = ::fcntl(commands, F_DUPFD, 10), to = ::fcntl(answers, F_DUPFD, 10);
  ::dup2(from, 3);
  ::dup2(to, 4);
  const int out = ::open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0600);
  ::dup2(out, STDOUT_FILENO);
  ::dup2(out, STDERR_FILENO);
  ::setpgid(0, 0);
  const std::string user_data = "--user-data-dir=" + profile;
  ::setenv("HOME", profile.c_str(), 1);
  ::execl(program.c_str(), program.c_str(), "--headless", "--remote-debugging-pipe", user_data.c_str(),
          "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
          "--disable-background-networking", "--disable-component-update", "--disable-sync",
          "--disable-dev-shm-usage", "--hide-scrollbars", "about:blank", static_cast<char*>(nullptr));
  ::_exit(127);
}

}  // namespace

std::string Browser::program() {
  for (const char* path : {"/usr/bin/chromium-headless-shell", "/usr/bin/chromium", "/usr/bin/google-chrome"})
    if (std::filesystem::exists(path)) return path;
  return {};
}

Browser::Browser(const Workplace& place, int width, int height) {
  std::array<int, 2> to{}, from{};
  // Commands go through a socket: writing to a browser that has ended is an error then, and no signal.
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, to.data()) != 0 ||
      ::pipe2(from.data(), O_CLOEXEC) != 0)
    throw std::runtime_error("no pipe");
  const std::string profile = (place / "browser").string(), log = (place / "browser-log").string();
  std::filesystem::create_directory(profile);
  const std::string name = program();
  processes_.leader = ::fork();
  if (processes_.leader == 0) become(name, profile, to[0], from[1], log);
  ::setpgid(processes_.leader, processes_.leader);
  ::close(to[0]);
  ::close(from[1]);
  commands_ = Descriptor(to[1]);
  answers_ = Descriptor(from[0]);
  const json target = command("Target.createTarget", {{"url", "about:blank"}})["targetId"];
  session_ = command("Target.attachToTarget", {{"targetId", target}, {"flatten", true}})["sessionId"];
  for (const char* domain : {"Page", "Runtime", "Log", "Network"})
    command(std::string(domain) + ".enable");
  resize(width, height);
}

Browser::ProcessGroup::~ProcessGroup() {
  if (leader <= 0) return;  // kill(-1, ...) would reach every process of the machine
  ::kill(-leader, SIGKILL);
  ::waitpid(leader, nullptr, 0);
}

void Browser::resize(int width, int height) {
  command("Emulation.setDeviceMetricsOverride",
          {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
}

void Browser::pause(int seconds) const {
  ::kill(-processes_.leader, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::seconds(seconds));
  ::kill(-processes_.leader, SIGCONT);
}

void Browser::close() {
  ::kill(-processes_.leader, SIGKILL);
  siginfo_t ended{};
  ::waitid(P_PID, static_cast<id_t>(processes_.leader), &ended, WEXITED | WNOWAIT);
}

json Browser::next_message() {
  while (true) {
    if (const size_t end = inbox_.find('\0'); end != std::string::npos) {
      json message = json::parse(inbox_.substr(0, end));
      inbox_.erase(0, end + 1);
      return message;
    }
    pollfd waiting{answers_.get(), POLLIN, 0};
    if (::poll(&waiting, 1, answer_timeout_ms) <= 0) throw std::runtime_error("the browser is silent");
    std::array<char, 65536> block{};
    const ssize_t got = ::read(answers_.get(), block.data(), block.size());
    if (got <= 0) throw std::runtime_error("the browser has ended");
    inbox_.append(block.data(), static_cast<size_t>(got));
  }
}

void Browser::note(const json& event) {
  const std::string method = event.value("method", "");
  const json& params = event.value("params", json::object());
  if (method == "Runtime.exceptionThrown") complaints_.push_back(params["exceptionDetails"].dump());
  if (method == "Log.entryAdded" && params["entry"]["level"] == "error")
    complaints_.push_back(params["entry"].dump());
  if (method == "Network.requestWillBeSent") requested_urls_.push_back(params["request"]["url"]);
  if (method == "Network.webSocketCreated") requested_urls_.push_back(params["url"]);
}

json Browser::command(const std::string& method, const json& params) {
  const int id = ++last_id_;
  json message{{"id", id}, {"method", method}, {"params", params}};
  if (!session_.empty()) message["sessionId"] = session_;
  const std::string text = message.dump() + '\0';
  if (::send(commands_.get(), text.data(), text.size(), MSG_NOSIGNAL) != static_cast<ssize_t>(text.size())) {
    throw std::runtime_error("the browser has ended");
  }
  while (true) {
    const json answer = next_message();
    if (answer.value("id", 0) != id) {
      note(answer);
      continue;
    }
    EXPECT_TRUE(answer.contains("result")) << method << ": " << answer.dump();
    return answer.value("result", json::object());
  }
}

void Browser::open(const std::string& url) { command("Page.navigate", {{"url", url}}); }

json Browser::value(const std::string& expression) {
  const json result = command("Runtime.evaluate",
                              {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  EXPECT_FALSE(result.contains("exceptionDetails")) << expression << ": " << result.dump();
  return result["result"].value("value", json());
}

void Browser::wait_until(const std::string& expression) {
  for (const auto end = std::chrono::steady_clock::now() + 60s; std::chrono::steady_clock::now() < end;) {
    if (value("(() => { try { return Boolean(" + expression + "); } catch { return false; } })()") == true)
      return;
    std::this_thread::sleep_for(20ms);
  }
  ADD_FAILURE() << "never true: " << expression << "\nthe page says: " << value("document.body.innerText");
}

void Browser::press(const std::string& key) {
  for (const char* type : {"keyDown", "keyUp"})
    command("Input.dispatchKeyEvent", {{"type", type}, {"key", key}, {"code", key}});
}

void Browser::drag(const std::vector<std::array<double, 2>>& path) {
  const auto mouse = [&](const char* type, const std::array<double, 2>& at, int buttons) {
    command("Input.dispatchMouseEvent", {{"type", type},
                                         {"x", at[0]},
                                         {"y", at[1]},
                                         {"button", "left"},
                                         {"buttons", buttons},
                                         {"clickCount", 1}});
  };
  mouse("mousePressed", path.front(), 1);
  for (size_t i = 1; i < path.size(); ++i)
    mouse("mouseMoved", path[i], 1);
  mouse("mouseReleased", path.back(), 0);
}

void Browser::choose_files(const std::string& selector, const std::vector<std::string>& files) {
  const json object =
      command("Runtime.evaluate", {{"expression", "document.querySelector('" + selector + "')"}});
  command("DOM.setFileInputFiles", {{"files", files}, {"objectId", object["result"]["objectId"]}});
}

void Browser::screenshot(const std::string& file) {
  const std::string data = command("Page.captureScreenshot", {{"format", "png"}})["data"];
  std::ofstream(file, std::ios::binary) << from_base64(data);
}

}  // namespace diastole::flow
