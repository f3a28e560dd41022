#include "host/rig/service_manager.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <string_view>

#include "host/transport/descriptor.hpp"

namespace diastole {
namespace {

constexpr int64_t beats_an_interval = 4;
constexpr std::chrono::milliseconds usual_server_interval{1000};

/// One datagram to NOTIFY_SOCKET, without waiting: libsystemd's sd_notify waits while the supervisor does not read,
/// and whoever supervises must not be able to hold up the acquisition.
void notify(const std::string& state) {
  const char* path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  if (path == nullptr || std::string_view(path).size() >= sizeof(address.sun_path)) return;
  const std::string_view name(path);
  address.sun_family = AF_UNIX;
  name.copy(address.sun_path, name.size());
  if (name.starts_with('@')) address.sun_path[0] = '\0';  // an abstract one
  const Descriptor socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + name.size());
  (void)::sendto(socket.get(), state.data(), state.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                 reinterpret_cast<const sockaddr*>(&address), size);
}

/// WATCHDOG_USEC, if it is meant for this process; else 0.
std::chrono::microseconds watchdog_interval() {
  const char* process = std::getenv("WATCHDOG_PID");
  const char* interval_us = std::getenv("WATCHDOG_USEC");
  if (interval_us == nullptr || (process != nullptr && std::atoi(process) != ::getpid())) {
    return std::chrono::microseconds(0);
  }
  return std::chrono::microseconds(std::max(0LL, std::atoll(interval_us)));
}

}  // namespace

ServiceManager::ServiceManager() : interval_(watchdog_interval()), server_seen_us_(now_us()) {}

int64_t ServiceManager::now_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now().time_since_epoch()).count();
}

void ServiceManager::ready() { notify("READY=1\nSTATUS=serving"); }
void ServiceManager::stopping() { notify("STOPPING=1\nSTATUS=stopping"); }
void ServiceManager::status(const std::string& text) { notify("STATUS=" + text); }

void ServiceManager::server_lives() { server_seen_us_ = now_us(); }

void ServiceManager::beat() {
  if (interval_.count() == 0) return;
  const int64_t now = now_us();
  if (now < next_beat_us_ || now - server_seen_us_ > interval_.count()) return;
  next_beat_us_ = now + interval_.count() / beats_an_interval;
  notify("WATCHDOG=1");
}

void ServiceManager::allow(std::chrono::microseconds patience) {
  if (interval_.count() > 0) notify(fmt::format("WATCHDOG_USEC={}", std::max(patience, interval_).count()));
}

void ServiceManager::allow_no_more() {
  if (interval_.count() > 0) notify(fmt::format("WATCHDOG_USEC={}\nWATCHDOG=1", interval_.count()));
}

std::chrono::milliseconds ServiceManager::server_interval() const {
  const auto quarter = std::chrono::duration_cast<std::chrono::milliseconds>(interval_ / beats_an_interval);
  return interval_.count() > 0 ? std::min(usual_server_interval, quarter) : usual_server_interval;
}

}  // namespace diastole
