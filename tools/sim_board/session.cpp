#include "tools/sim_board/session.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "protocol/contract/bounded_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"
#include "tools/sim_board/emulated_controller.hpp"
#include "tools/sim_board/loop_back.hpp"
#include "tools/sim_controller/pin_trace.hpp"
#include "tools/sim_controller/pty_line.hpp"

namespace diastole {
namespace {

using WallClock = std::chrono::steady_clock;

constexpr uint64_t slice_ns = 1'000'000;
constexpr uint64_t dark_ns = 500'000'000;  // how long power stays away after a cut
constexpr uint32_t start_of_flash = 0x0800'0000;

uint64_t nanoseconds(double time_s) { return static_cast<uint64_t>(time_s * 1e9 + 0.5); }

/// The flash's content from the last session, when there is one; it wins over the images.
void restore_flash(SimBoard& board, const std::string& file) {
  if (!std::ifstream(file)) return;
  const std::string content = read_bounded_file(file, most_table_bytes);
  const std::vector<uint8_t> bytes(content.begin(), content.end());
  if (bytes.size() != board.flash().size()) {
    throw InputError(
        {file, "",
         fmt::format("holds {} bytes, not the {} of the board's flash", bytes.size(), board.flash().size()),
         "Give a file that --flash has written, or a new name."});
  }
  board.load(bytes, start_of_flash);
}

void keep_flash(const SimBoard& board, const std::string& file) {
  const std::string unfinished = file + ".part";
  {
    std::ofstream stream(unfinished, std::ios::binary | std::ios::trunc);
    const auto bytes = board.flash();
    stream.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!stream.flush()) {
      throw InputError({file, "", "cannot be written", "Choose a place with room where you may write."});
    }
  }
  std::filesystem::rename(unfinished, file);
}

bool readable(int descriptor) {
  pollfd state{descriptor, POLLIN, 0};
  return ::poll(&state, 1, 0) > 0;
}

/// When a button is pressed or a switch is closed from outside, and when it is let go.
struct Span {
  double from_s = 0;
  std::optional<double> to_s;
};
struct LimitAt {
  Span span;
  bool far = false;
};

std::optional<double> parse_time(const std::string& text) {
  try {
    std::size_t used = 0;
    const double time_s = std::stod(text, &used);
    if (used == text.size() && std::isfinite(time_s) && time_s >= 0) return time_s;
  } catch (const std::exception&) {
    return std::nullopt;
  }
  return std::nullopt;
}

/// "2.5" or "2.5..4"; throws InputError, naming `option`, for anything else.
Span parse_span(const std::string& text, const std::string& option) {
  const auto dots = text.find("..");
  const auto from_s = parse_time(text.substr(0, dots));
  if (dots == std::string::npos) {
    if (from_s) return {*from_s, std::nullopt};
  } else if (const auto to_s = parse_time(text.substr(dots + 2)); from_s && to_s && *to_s > *from_s) {
    return {*from_s, *to_s};
  }
  throw InputError({"", option, fmt::format("'{}' is no time, nor one time and a later one", text),
                    "Write seconds, such as 2.5 or 2.5..4."});
}

/// "2.5:home", "2.5..4:far"; throws InputError for anything else.
LimitAt parse_limit(const std::string& text) {
  const auto colon = text.find(':');
  const std::string which = colon == std::string::npos ? "" : text.substr(colon + 1);
  if (which == "home" || which == "far")
    return {parse_span(text.substr(0, colon), "--limit-at"), which == "far"};
  throw InputError(
      {"", "--limit-at", fmt::format("'{}' is no time and switch", text), "Write 2.5:home or 2.5..4:far."});
}

class Session {
 public:
  Session(const SessionOptions& options, std::vector<Image> images)
      : options_(options),
        controller_(images, {}, {.crystal_Hz = options.crystal_Hz, .flash_timing = options.flash_timing}) {
    report_.images = std::move(images);
    if (!options.pins.empty()) trace_.emplace(options.pins);
    if (!options.link.empty()) line_.emplace(options.link);
    if (!options.flash.empty()) {
      restore_flash(controller_.board(), options.flash);
      controller_.board().power_cycle();
    }
    if (options.loop_back) connect_loop_back(controller_.board(), {});
    move_switches();
    controller_.board().cut_power_at_flash_operation(options.power_cut);
  }

  BoardReport run(int stop) {
    if (line_) {
      if (!options_.real_time)
        fmt::print(stderr, "without --real-time the board's time runs ahead of whoever opens the port\n");
      fmt::print("{}\n", json_text(nlohmann::json{{"port", line_->path()}}));
      std::fflush(stdout);
    }
    const auto began = WallClock::now();
    const uint64_t end_ns = options_.seconds ? nanoseconds(*options_.seconds) : UINT64_MAX;
    for (uint64_t until = 0; until < end_ns && !readable(stop);) {
      until = std::min(end_ns, until + slice_ns);
      if (options_.real_time) std::this_thread::sleep_until(began + std::chrono::nanoseconds(until));
      advance(until);
    }
    report_.wall_s = std::chrono::duration<double>(WallClock::now() - began).count();
    if (trace_) trace_->close();
    if (!options_.flash.empty()) keep_flash(controller_.board(), options_.flash);
    report_.board = controller_.board().statistics();
    return std::move(report_);
  }

 private:
  void move_switches() {
    for (const std::string& text : options_.estop_at) {
      const Span span = parse_span(text, "--estop-at");
      controller_.press_estop(nanoseconds(span.from_s));
      if (span.to_s) controller_.press_estop(nanoseconds(*span.to_s), false);
    }
    for (const std::string& text : options_.limit_at) {
      const auto [span, far] = parse_limit(text);
      const auto close = [this, is_far = far](double time_s, bool closed) {
        is_far ? controller_.close_far_limit(nanoseconds(time_s), closed)
               : controller_.close_home(nanoseconds(time_s), closed);
      };
      close(span.from_s, true);
      if (span.to_s) close(*span.to_s, false);
    }
  }

  void advance(uint64_t until_ns) {
    if (line_) {
      line_->refresh();
      controller_.receive(line_->read());
    }
    const auto output = controller_.advance_to(until_ns);
    for (const sim_controller::PinEdge& edge : output.edges) {
      if (trace_) trace_->write(edge);
      if (edge.pin == sim_controller::Pin::step && edge.value == 1) ++report_.steps;
      if (edge.pin == sim_controller::Pin::ttl && edge.value == 1) ++report_.triggers;
    }
    if (line_) line_->write(output.sent);
    restore_power();
  }

  void restore_power() {
    SimBoard& board = controller_.board();
    if (board.powered()) return;
    if (!dark_until_ns_) {
      dark_until_ns_ = board.now_ns() + dark_ns;
      fmt::print(stderr, "power cut at {:.6f} s, in flash operation {}\n",
                 static_cast<double>(board.now_ns()) * 1e-9, board.statistics().flash_operations);
      board.cut_power_at_flash_operation(std::nullopt);
    } else if (board.now_ns() >= *dark_until_ns_) {
      dark_until_ns_.reset();
      board.power_on();
    }
  }

  const SessionOptions& options_;
  EmulatedController controller_;
  std::optional<sim_controller::PinTrace> trace_;
  std::optional<sim_controller::PtyLine> line_;
  std::optional<uint64_t> dark_until_ns_;
  BoardReport report_;
};

}  // namespace

BoardReport run_session(const SessionOptions& options, int stop) {
  std::vector<Image> images;
  for (const std::string& argument : options.images)
    images.push_back(read_image(argument));
  return Session(options, std::move(images)).run(stop);
}

}  // namespace diastole
