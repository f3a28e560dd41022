#include "firmware/boards/stm32f405/boot_identity.hpp"

#include "firmware/boards/stm32f405/hand_over.hpp"
#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

namespace {

std::uint32_t random_number() {
  constexpr std::uint32_t kEnable = 1U << 2, kReady = 1U << 0;
  rng().CR.write(kEnable);
  for (int wait = 0; wait < 10'000; ++wait)
    if ((rng().SR.read() & kReady) != 0) return rng().DR.read();
  return 0;
}

}  // namespace

wire::ResetCause take_reset_cause() {
  const std::uint32_t flags = rcc().CSR.read();
  rcc().CSR.set(1U << 24);
  if ((flags & (1U << 29 | 1U << 30)) != 0) return wire::ResetCause::watchdog;
  if ((flags & 1U << 28) != 0) return wire::ResetCause::software;
  if ((flags & 1U << 27) != 0) return wire::ResetCause::power_on;
  if ((flags & 1U << 26) != 0) return wire::ResetCause::reset_pin;
  return wire::ResetCause::unknown;
}

std::uint32_t make_boot_id(std::uint32_t starts) { return random_number() ^ starts * 0x9E37'79B9U; }

firmware::Identity read_identity() {
  const HandOver hand_over = read_hand_over().value_or(HandOver{});
  return {kBoardId, make_boot_id(hand_over.starts), hand_over.reset_cause};
}

}  // namespace diastole::stm32
