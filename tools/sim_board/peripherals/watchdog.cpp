#include "tools/sim_board/peripherals/watchdog.hpp"

#include <algorithm>

namespace diastole::board_model {
namespace {

constexpr uint32_t key_reload = 0xaaaa, key_unlock = 0x5555, key_start = 0xcccc;
constexpr uint64_t tick_ns = 31'250;  // LSI, typical

}  // namespace

Watchdog::Watchdog(const Clock& clock, Scheduler& scheduler)
    : clock_(clock), scheduler_(scheduler), slot_(scheduler.add(*this)) {}

void Watchdog::reset() {
  prescaler_ = 0;
  reload_ = 0xfff;
  unlocked_ = running_ = false;
  ask();
}

uint32_t Watchdog::read(uint32_t offset) {
  switch (offset) {
    case 0x04:
      return prescaler_;
    case 0x08:
      return reload_;
    default:
      return 0;  // updates of prescaler and reload are immediate: SR stays 0
  }
}

void Watchdog::write(uint32_t offset, uint32_t value, uint32_t mask) {
  const uint32_t bits = value & mask;
  switch (offset) {
    case 0x00:
      unlocked_ = bits == key_unlock;
      if (bits == key_start) running_ = true;
      if (bits == key_start || bits == key_reload) reload();
      break;
    case 0x04:
      if (unlocked_) prescaler_ = bits & 7;
      break;
    case 0x08:
      if (unlocked_) reload_ = bits & 0xfff;
      break;
    default:
      break;
  }
}

void Watchdog::reload() {
  const uint64_t divider = 4U << std::min(prescaler_, 6U);
  bites_at_ns_ = clock_.ns(clock_.now()) + (uint64_t{reload_} + 1) * divider * tick_ns;
  ask();
}

void Watchdog::ask() { scheduler_.set(slot_, running_ ? clock_.cycle_at(bites_at_ns_) : never); }

void Watchdog::on_event(Cycles) {
  running_ = false;
  if (bite_) bite_();
}

}  // namespace diastole::board_model
