#include "firmware/boards/stm32f405/boot_identity.hpp"

#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

namespace {

constexpr std::uint16_t kBoardId = 2;

/// Survives a reset, is arbitrary after power-on: tells starts apart even if the random generator does not
/// run.
[[gnu::section(".noinit")]] std::uint32_t starts;

std::uint32_t random_number() {
  constexpr std::uint32_t kEnable = 1U << 2, kReady = 1U << 0;
  rng().CR.write(kEnable);
  for (int wait = 0; wait < 10'000; ++wait)
    if ((rng().SR.read() & kReady) != 0) return rng().DR.read();
  return 0;
}

wire::ResetCause reset_cause() {
  const std::uint32_t flags = rcc().CSR.read();
  rcc().CSR.set(1U << 24);
  if ((flags & (1U << 29 | 1U << 30)) != 0) return wire::ResetCause::watchdog;
  if ((flags & 1U << 28) != 0) return wire::ResetCause::software;
  if ((flags & 1U << 27) != 0) return wire::ResetCause::power_on;
  if ((flags & 1U << 26) != 0) return wire::ResetCause::reset_pin;
  return wire::ResetCause::unknown;
}

}  // namespace

firmware::Identity read_identity() {
  starts = starts + 0x9E37'79B9U;
  return {kBoardId, random_number() ^ starts, reset_cause()};
}

}  // namespace diastole::stm32
