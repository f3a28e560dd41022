#pragma once
// `diastole desk` as a whole program, through its endpoint and in a real browser. Screenshots go to the directory that
// DIASTOLE_SCREENSHOTS names, if it does.

#include <gmock/gmock.h>

#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "tests/flow/browser.hpp"
#include "tests/flow/programs.hpp"
#include "tests/flow/web_client.hpp"

namespace diastole::flow {

using Path = std::vector<std::array<double, 2>>;

class DeskProgram : public testing::Test {
 protected:
  void begin(const std::string& folder, const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"diastole", "desk", folder, "--no-browser", "--json"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    desk = std::make_unique<Program>(place, arguments);
    ASSERT_TRUE(desk->wait_for_text("url")) << desk->err();
    url = nlohmann::json::parse(desk->out())["url"];
    port = std::stoi(url.substr(url.find(':', 7) + 1));
    token = url.substr(url.find("token=") + 6);
  }
  WebAnswer get(const std::string& path) const {
    return WebClient(port).get(path, {"Authorization: Bearer " + token});
  }
  WebAnswer post(const std::string& path, const std::string& body, const std::string& with_token) const {
    WebClient client(port);
    client.send("POST " + path + " HTTP/1.1\r\nHost: 127.0.0.1:" + std::to_string(port) +
                "\r\nAuthorization: Bearer " + with_token +
                "\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body);
    return client.read_answer();
  }

  void open_page(int width, int height, int players) {
    browser = std::make_unique<Browser>(place, width, height);
    browser->open(url);
    browser->wait_until("desk.players.length === " + std::to_string(players));
  }
  void click(const std::string& selector) {
    browser->value("document.querySelector('" + selector + "').click()");
  }
  /// Places of a picture in the window.
  Path in_window(int player, const Path& places_px) {
    const std::string name = "desk.players[" + std::to_string(player) + "]";
    browser->value(name + ".canvas.scrollIntoView({block: 'center'})");
    const nlohmann::json box =
        browser->value("((b, s) => [b.left, b.top, b.width / s.columns, b.height / s.rows])(" + name +
                       ".canvas.getBoundingClientRect(), " + name + ".slice)");
    Path path;
    for (const auto& [column, row] : places_px)
      path.push_back({box[0].get<double>() + (column + 0.5) * box[2].get<double>(),
                      box[1].get<double>() + (row + 0.5) * box[3].get<double>()});
    return path;
  }
  void screenshot(const std::string& name) {
    if (const char* directory = std::getenv("DIASTOLE_SCREENSHOTS"))
      browser->screenshot(std::string(directory) + "/" + name);
  }
  /// Nothing was complained of, nothing asked for elsewhere, it fits a telephone, and when the program ends the page says so.
  void expect_a_good_page() {
    EXPECT_THAT(browser->complaints(), testing::IsEmpty());
    const std::string base = url.substr(0, url.find('#'));
    for (const std::string& asked : browser->requested_urls())
      EXPECT_THAT(asked, testing::StartsWith(base));
    browser->resize(390, 800);
    EXPECT_EQ(browser->value("document.documentElement.scrollWidth <= 390"), true)
        << "wider than a telephone";
    desk->signal(SIGTERM);
    browser->wait_until("document.getElementById('problem').textContent.includes('stands in the file')");
  }

  Workplace place;
  std::unique_ptr<Program> desk;
  std::unique_ptr<Browser> browser;
  std::string url, token;
  int port = 0;
};

}  // namespace diastole::flow
