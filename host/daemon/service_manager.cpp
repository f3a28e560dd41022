#include "host/daemon/service_manager.hpp"

#include <fmt/format.h>
#include <systemd/sd-daemon.h>

#include <algorithm>

namespace diastole {
namespace {

constexpr int64_t beats_an_interval = 4;
constexpr std::chrono::milliseconds usual_server_interval{1000};

void tell(const std::string& state) { (void)sd_notify(0, state.c_str()); }

}  // namespace

ServiceManager::ServiceManager() : server_seen_us_(now_us()) {
  uint64_t interval_us = 0;
  if (sd_watchdog_enabled(0, &interval_us) > 0) interval_ = std::chrono::microseconds(interval_us);
}

int64_t ServiceManager::now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count();
}

void ServiceManager::ready() { tell("READY=1\nSTATUS=serving"); }
void ServiceManager::stopping() { tell("STOPPING=1\nSTATUS=stopping"); }
void ServiceManager::status(const std::string& text) { tell("STATUS=" + text); }

void ServiceManager::server_lives() { server_seen_us_ = now_us(); }

void ServiceManager::beat() {
  if (interval_.count() == 0) return;
  const int64_t now = now_us();
  if (now < next_beat_us_ || now - server_seen_us_ > interval_.count()) return;
  next_beat_us_ = now + interval_.count() / beats_an_interval;
  tell("WATCHDOG=1");
}

void ServiceManager::allow(std::chrono::microseconds patience) {
  if (interval_.count() > 0) tell(fmt::format("WATCHDOG_USEC={}", std::max(patience, interval_).count()));
}

void ServiceManager::allow_no_more() {
  if (interval_.count() > 0) tell(fmt::format("WATCHDOG_USEC={}\nWATCHDOG=1", interval_.count()));
}

std::chrono::milliseconds ServiceManager::server_interval() const {
  const auto quarter = std::chrono::duration_cast<std::chrono::milliseconds>(interval_ / beats_an_interval);
  return interval_.count() > 0 ? std::min(usual_server_interval, quarter) : usual_server_interval;
}

}  // namespace diastole
