#pragma once
// The daemon's own controller client before the real image: its clock is the board's, its line the board's serial
// port. No threads, no devices.

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "host/config/rig_config.hpp"
#include "host/controller/controller_client.hpp"
#include "tools/sim_board/emulated_controller.hpp"

namespace diastole::sim_board_test {

inline constexpr uint64_t ms = 1'000'000;  // ns

class EmulatedDesk final : public Clock {
 public:
  explicit EmulatedDesk(const std::string& image, SimBoardOptions options = {})
      : controller({read_image(image)}, {}, options) {}
  EmulatedDesk(const EmulatedDesk&) = delete;
  EmulatedDesk& operator=(const EmulatedDesk&) = delete;
  /// Whatever happened, no register was used otherwise than the manual says (register_facts.hpp).
  ~EmulatedDesk() override {
    for (const auto& [what, note] : controller.board().statistics().notes)
      if (planted.empty() || what.find(planted) == std::string::npos)
        ADD_FAILURE() << what << ", " << note.count << " times, first at " << note.first_ns << " ns";
  }

  /// Something that happens to the board at a time to come, while it runs.
  void at(uint64_t time_ns, std::function<void()> happens) { plans_.emplace(time_ns, std::move(happens)); }

  [[nodiscard]] uint64_t now_ns() override { return controller.board().now_ns(); }
  [[nodiscard]] bool stands_still() const override { return true; }
  void sleep_until_ns(uint64_t until_ns, ByteLine*) override {
    while (!plans_.empty() && plans_.begin()->first <= until_ns) {
      const auto plan = plans_.extract(plans_.begin());
      advance(plan.key());
      plan.mapped()();
    }
    advance(until_ns);
  }

  EmulatedController controller;
  std::string planted;  ///< what the notes of a fault say that a test has made
  std::deque<uint8_t> to_host;
  std::vector<sim_controller::PinEdge> edges;

 private:
  void advance(uint64_t until_ns) {
    const auto output = controller.advance_to(until_ns);
    to_host.insert(to_host.end(), output.sent.begin(), output.sent.end());
    edges.insert(edges.end(), output.edges.begin(), output.edges.end());
  }

  std::multimap<uint64_t, std::function<void()>> plans_;
};

class EmulatedLine final : public ByteLine {
 public:
  explicit EmulatedLine(EmulatedDesk& desk) : desk_(desk) { desk_.to_host.clear(); }
  void write(std::span<const uint8_t> bytes) override { desk_.controller.receive(bytes); }
  size_t read(std::span<uint8_t> out) override {
    const size_t count = std::min(out.size(), desk_.to_host.size());
    const auto end = desk_.to_host.begin() + static_cast<std::ptrdiff_t>(count);
    std::copy(desk_.to_host.begin(), end, out.begin());
    desk_.to_host.erase(desk_.to_host.begin(), end);
    return count;
  }
  void flush(int) override {}
  void wait_received(uint64_t, int) override {}
  [[nodiscard]] bool lost() const override { return false; }
  [[nodiscard]] uint64_t written_total() const override { return 0; }
  [[nodiscard]] uint64_t received_total() const override { return 0; }
  [[nodiscard]] int descriptor() const override { return -1; }

 private:
  EmulatedDesk& desk_;
};

}  // namespace diastole::sim_board_test
