#include <poll.h>
#include <time.h>

#include "host/transport/clock.hpp"

namespace diastole {
namespace {

constexpr uint64_t ns_per_s = 1'000'000'000;

}  // namespace

uint64_t RealClock::now_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return static_cast<uint64_t>(now.tv_sec) * ns_per_s + static_cast<uint64_t>(now.tv_nsec);
}

void RealClock::sleep_until_ns(uint64_t until_ns, ByteLine* line) {
  const uint64_t now = now_ns();
  if (until_ns <= now) return;
  const uint64_t left = until_ns - now;
  const timespec timeout{static_cast<time_t>(left / ns_per_s), static_cast<long>(left % ns_per_s)};
  const bool watched = line != nullptr && !line->lost() && line->descriptor() >= 0;
  pollfd state{watched ? line->descriptor() : -1, POLLIN, 0};
  ppoll(&state, watched ? 1 : 0, &timeout, nullptr);
}

}  // namespace diastole
