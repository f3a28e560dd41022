#pragma once
// What a command that takes its time says meanwhile, to a person at a terminal:
//
//   const WaitingLine line("reading gel.run.h5");     // after two seconds: reading gel.run.h5: 2 s
//
// On standard error, one line that renews itself each second and goes away at the end. Nothing if standard error is no terminal.

#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>
#include <utility>

namespace diastole {

class WaitingLine {
 public:
  /// From then on somebody wonders whether it has hung.
  static constexpr std::chrono::seconds quiet{2};

  explicit WaitingLine(std::string what, std::FILE* to = stderr) : what_(std::move(what)), to_(to) {
    if (::isatty(::fileno(to)) != 0)
      shower_ = std::jthread([this](const std::stop_token& stop) { show(stop); });
  }
  WaitingLine(const WaitingLine&) = delete;
  WaitingLine& operator=(const WaitingLine&) = delete;

 private:
  void show(const std::stop_token& stop) {
    std::mutex unshared;
    std::unique_lock lock(unshared);
    std::condition_variable_any over;
    const auto ends_within = [&](std::chrono::seconds time) {
      return over.wait_for(lock, stop, time, [&] { return stop.stop_requested(); });
    };
    std::chrono::seconds passed = quiet;
    if (ends_within(quiet)) return;
    do {
      std::fprintf(to_, "\r%s: %lld s", what_.c_str(), static_cast<long long>(passed.count()));
      std::fflush(to_);
      ++passed;
    } while (!ends_within(std::chrono::seconds(1)));
    std::fputs("\r\033[K", to_);
    std::fflush(to_);
  }

  std::string what_;
  std::FILE* to_;
  std::jthread shower_;  // last: it uses the members above
};

}  // namespace diastole
