#include "host/gpio/gate_inputs.hpp"

#include <fmt/format.h>
#include <gpiod.h>
#include <poll.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <mutex>
#include <thread>
#include <utility>

#include "host/transport/clock.hpp"
#include "host/transport/real_time.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

constexpr int kernel_buffer_events = 16;
constexpr int look_interval_ms = 20;
constexpr std::chrono::milliseconds flood_pause{1};
constexpr uint64_t ns_per_s = 1'000'000'000;
constexpr const char* consumer = "diastole";

uint64_t ns_of(const timespec& time) {
  return static_cast<uint64_t>(time.tv_sec) * ns_per_s + static_cast<uint64_t>(time.tv_nsec);
}

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using Chip = std::unique_ptr<gpiod_chip, CloseChip>;

Chip open_chip(const std::string& name) {
  Chip chip(gpiod_chip_open_lookup(name.c_str()));
  if (chip != nullptr) return chip;
  throw HardwareError("GPIO chip " + name, fmt::format("cannot be opened: {}", std::strerror(errno)),
                      "gpiodetect lists the chips; your user needs access to /dev/gpiochip*.");
}

/// An input line whose edges are asked for.
gpiod_line* request(gpiod_chip* chip, const GpioConfig& config, unsigned offset, bool active_low,
                    bool both_edges) {
  gpiod_line* line = gpiod_chip_get_line(chip, offset);
  const int flags = active_low ? GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW : 0;
  const auto ask =
      both_edges ? gpiod_line_request_both_edges_events_flags : gpiod_line_request_rising_edge_events_flags;
  if (line != nullptr && ask(line, consumer, flags) == 0) return line;
  throw HardwareError(
      fmt::format("line {} of GPIO chip {}", offset, config.chip),
      fmt::format("cannot be watched: {}", std::strerror(errno)),
      "gpioinfo tells which lines there are and who uses them; check [gpio] in the rig file.");
}

class GpioInputs final : public GateInputs {
 public:
  explicit GpioInputs(const GpioConfig& config) : config_(config), chip_(open_chip(config.chip)) {
    if (config.gate_line) {
      gate_ = request(chip_.get(), config, *config.gate_line, config.gate_active_low, false);
    }
    if (config.estop_line) {
      estop_ = request(chip_.get(), config, *config.estop_line, config.estop_active_low, true);
      pressed_ = gpiod_line_get_value(estop_) == 1;
    }
    thread_ = std::jthread([this](const std::stop_token& stop) { watch(stop); });
  }

  [[nodiscard]] std::string describe() const override { return "GPIO chip " + config_.chip; }
  [[nodiscard]] bool counts_pulses() const override { return gate_ != nullptr; }
  [[nodiscard]] bool sees_estop() const override { return estop_ != nullptr; }
  [[nodiscard]] bool estop_pressed() const override { return pressed_; }

  GateReading take() override {
    const std::lock_guard lock(mutex_);
    return std::exchange(seen_, {});
  }

 private:
  using Events = std::array<gpiod_line_event, kernel_buffer_events>;

  void watch(const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      std::array<pollfd, 2> states{{{descriptor(gate_), POLLIN, 0}, {descriptor(estop_), POLLIN, 0}}};
      if (::poll(states.data(), states.size(), look_interval_ms) < 0 && errno != EINTR) {
        return fail(std::strerror(errno));
      }
      if ((states[0].revents & POLLIN) != 0 && !take_pulses()) return;
      if ((states[1].revents & POLLIN) != 0 && !take_estop_edges()) return;
      if (std::exchange(flooded_, false)) std::this_thread::sleep_for(flood_pause);
      if (is_broken(states[0].revents) || is_broken(states[1].revents)) {
        return fail("the kernel has taken the line away");
      }
      if (estop_ != nullptr) look_at_estop();
    }
  }

  /// As when the chip is unplugged: poll would return at once for ever.
  static bool is_broken(short events) { return (events & (POLLERR | POLLHUP | POLLNVAL)) != 0; }

  static int descriptor(gpiod_line* line) { return line == nullptr ? -1 : gpiod_line_event_get_fd(line); }

  bool take_pulses() {
    Events events{};
    const int count = gpiod_line_event_read_multiple(gate_, events.data(), events.size());
    if (count < 0) return fail(std::strerror(errno)), false;
    const std::lock_guard lock(mutex_);
    for (int i = 0; i < count; ++i)
      seen_.note_pulse(ns_of(events[static_cast<size_t>(i)].ts));
    flooded_ = count == kernel_buffer_events;
    seen_.may_have_lost = seen_.may_have_lost || flooded_;
    return true;
  }

  bool take_estop_edges() {
    Events events{};
    const int count = gpiod_line_event_read_multiple(estop_, events.data(), events.size());
    if (count < 0) return fail(std::strerror(errno)), false;
    flooded_ = flooded_ || count == kernel_buffer_events;
    for (int i = 0; i < count; ++i) {
      const gpiod_line_event& event = events[static_cast<size_t>(i)];
      note_estop({ns_of(event.ts), event.event_type == GPIOD_LINE_EVENT_RISING_EDGE, true});
    }
    return true;
  }

  /// Level and edges agree unless an edge was lost, or is waiting to be read.
  void look_at_estop() {
    const int level = gpiod_line_get_value(estop_);
    if (level < 0 || (level == 1) == pressed_) return;
    pollfd state{descriptor(estop_), POLLIN, 0};
    if (::poll(&state, 1, 0) > 0) return;
    note_estop({RealClock().now_ns(), level == 1, false});
  }

  void note_estop(const EstopChange& change) {
    const std::lock_guard lock(mutex_);
    pressed_ = change.pressed;
    seen_.note_estop(change);
  }

  void fail(const std::string& problem) {
    const std::lock_guard lock(mutex_);
    seen_.problem = problem;
  }

  GpioConfig config_;
  Chip chip_;                    // releases its lines
  gpiod_line* gate_ = nullptr;   // of chip_
  gpiod_line* estop_ = nullptr;  // of chip_
  std::atomic<bool> pressed_ = false;
  bool flooded_ = false;  // of the thread: a whole buffer of edges was there
  InheritingMutex mutex_;
  GateReading seen_;
  std::jthread thread_;  // last: it uses the members above
};

}  // namespace

std::unique_ptr<GateInputs> open_gpio(const GpioConfig& config) {
  return std::make_unique<GpioInputs>(config);
}

}  // namespace diastole
