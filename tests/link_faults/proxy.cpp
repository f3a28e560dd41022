#include "tests/link_faults/proxy.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "host/transport/serial_port.hpp"
#include "protocol/contract/input_error.hpp"
#include "tools/sim_controller/pty_line.hpp"

namespace diastole::link_faults {
namespace {

constexpr std::uint64_t look_again_us = 10'000;  // whether somebody has opened the pseudo-terminal

class Proxy {
 public:
  explicit Proxy(const ProxyOptions& options)
      : options_(options),
        port_(options.port, options.baud),
        line_(options.link),
        to_controller_(options.to_controller, options.seed),
        to_host_(options.to_host, options.seed + 1) {}

  ProxyReport run(int stop) {
    fmt::print("{}\n", nlohmann::json{{"port", line_.path()}}.dump());
    std::fflush(stdout);
    const std::uint64_t end_us =
        options_.seconds ? static_cast<std::uint64_t>(*options_.seconds * 1e6) : UINT64_MAX;
    while (now_us() < end_us && !wait(stop, end_us))
      carry();
    return {to_controller_.counts(), to_host_.counts(), static_cast<double>(now_us()) * 1e-6};
  }

 private:
  [[nodiscard]] std::uint64_t now_us() const {
    return static_cast<std::uint64_t>(
        std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - began_)
            .count());
  }

  /// Until bytes come or are due; true when asked to stop.
  bool wait(int stop, std::uint64_t end_us) {
    const std::uint64_t now = now_us();
    std::uint64_t until = std::min(now + look_again_us, end_us);
    for (const LineFaults* faults : {&to_controller_, &to_host_})
      if (const auto due = faults->next_due_us()) until = std::min(until, std::max(now, *due));
    std::array<pollfd, 3> watched{
        {{stop, POLLIN, 0}, {port_.descriptor(), POLLIN, 0}, {line_.descriptor(), POLLIN, 0}}};
    const std::uint64_t wait_us = until - now;
    const timespec timeout{static_cast<time_t>(wait_us / 1'000'000),
                           static_cast<long>(wait_us % 1'000'000) * 1000};
    ::ppoll(watched.data(), watched.size(), &timeout, nullptr);
    return (watched[0].revents & POLLIN) != 0;
  }

  void carry() {
    const std::uint64_t now = now_us();
    line_.refresh();
    to_controller_.push(line_.read(), now);
    std::array<std::uint8_t, 4096> block{};
    for (auto count = port_.read(block); count > 0; count = port_.read(block))
      to_host_.push(std::span(block).first(count), now);
    if (port_.lost()) {
      line_.hang_up();
      throw HardwareError(options_.port, "the serial port is gone",
                          "Check the cable, then start link_faults again.");
    }
    port_.write(to_controller_.take(now));
    line_.write(to_host_.take(now));
    line_.send_queued();
  }

  const ProxyOptions& options_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
  SerialPort port_;
  sim_controller::PtyLine line_;
  LineFaults to_controller_, to_host_;
};

std::string row(const char* name, const FaultCounts& counts) {
  return fmt::format("{:<14} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n", name, counts.frames,
                     counts.damaged, counts.bits_flipped, counts.bytes_lost, counts.lost, counts.repeated,
                     counts.reordered, counts.truncated);
}

}  // namespace

ProxyReport run_proxy(const ProxyOptions& options, int stop) { return Proxy(options).run(stop); }

std::string to_text(const ProxyReport& report) {
  return fmt::format("{:<14} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9} {:>9}\n", "direction", "frames",
                     "damaged", "bits", "bytes", "lost", "repeated", "reordered", "cut off") +
         row("to controller", report.to_controller) + row("to host", report.to_host);
}

}  // namespace diastole::link_faults
