#pragma once
// A headless Chromium, driven through the pipe of its DevTools protocol: no driver program, no port.

#include <array>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "host/transport/descriptor.hpp"
#include "tests/flow/programs.hpp"

namespace diastole::flow {

class Browser {
 public:
  /// The browser's program, or empty if this machine has none.
  static std::string program();

  /// Opens an empty page of this size in a browser with an empty profile in `place`.
  Browser(const Workplace& place, int width, int height);
  void open(const std::string& url);
  void resize(int width, int height);
  /// Ends it; whatever is asked of it afterwards throws std::runtime_error.
  void close();
  /// All of its processes stand still for so long, as on a computer that sleeps.
  void pause(int seconds) const;
  /// The value of a JavaScript expression; a failed expectation and null if it throws.
  nlohmann::json value(const std::string& expression);
  /// Waits until the expression is true; a failed expectation after a minute.
  void wait_until(const std::string& expression);
  /// Presses and releases a key, as a person at the keyboard.
  void press(const std::string& key);
  /// Presses the mouse at the first of these places of the window, moves it through the others and lets go.
  void drag(const std::vector<std::array<double, 2>>& path);
  /// Chooses files in a file field.
  void choose_files(const std::string& selector, const std::vector<std::string>& files);
  void screenshot(const std::string& file);

  /// What the page's console complained of: exceptions, refused contents, failed requests.
  [[nodiscard]] const std::vector<std::string>& complaints() const { return complaints_; }
  /// All that the page asked for.
  [[nodiscard]] const std::vector<std::string>& requested_urls() const { return requested_urls_; }

 private:
  /// One command of the protocol and its result.
  nlohmann::json command(const std::string& method, const nlohmann::json& params = nlohmann::json::object());
  nlohmann::json next_message();
  void note(const nlohmann::json& event);

  /// The browser with its helpers; they end with this.
  struct ProcessGroup {
    pid_t leader = -1;
    ProcessGroup() = default;
    ProcessGroup(const ProcessGroup&) = delete;
    ProcessGroup& operator=(const ProcessGroup&) = delete;
    ~ProcessGroup();
  };
  ProcessGroup processes_;
  Descriptor commands_, answers_;
  std::string inbox_;
  std::string session_;
  int last_id_ = 0;
  std::vector<std::string> complaints_;
  std::vector<std::string> requested_urls_;
};

}  // namespace diastole::flow
