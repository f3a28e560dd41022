#include "firmware/boards/stm32f405/boot_identity.hpp"

#include "firmware/boards/stm32f405/hand_over.hpp"
#include "firmware/boards/stm32f405/registers.hpp"

namespace diastole::stm32 {

namespace {

/// The first number after RNGEN is not to be used (RM0090 24.3.1); nor any that came with a seed or clock error.
std::uint32_t random_number() {
  constexpr std::uint32_t kEnable = 1U << 2, kReady = 1U << 0, kErrors = 3U << 1;
  rng().CR.write(kEnable);
  int numbers = 0;
  for (int wait = 0; wait < 10'000; ++wait) {
    const std::uint32_t status = rng().SR.read();
    if ((status & kReady) == 0) continue;
    const std::uint32_t number = rng().DR.read();
    if (++numbers > 1 && (status & kErrors) == 0) return number;
  }
  return 0;
}

}  // namespace

wire::ResetCause take_reset_cause() {
  const std::uint32_t flags = rcc().CSR.read();
  rcc().CSR.set(1U << 24);
  // Power-on first: the bootloader's reset for new option bytes comes before anybody has read the flags.
  if ((flags & 1U << 27) != 0) return wire::ResetCause::power_on;
  if ((flags & (1U << 29 | 1U << 30)) != 0) return wire::ResetCause::watchdog;
  if ((flags & 1U << 28) != 0) return wire::ResetCause::software;
  if ((flags & 1U << 26) != 0) return wire::ResetCause::reset_pin;
  return wire::ResetCause::unknown;
}

std::uint32_t make_boot_id(std::uint32_t starts) { return random_number() ^ starts * 0x9E37'79B9U; }

firmware::Identity read_identity() {
  const HandOver hand_over = read_hand_over().value_or(HandOver{});
  return {kBoardId, make_boot_id(hand_over.starts), hand_over.reset_cause};
}

}  // namespace diastole::stm32
