#include "firmware/boards/stm32f405/hand_over.hpp"

#include <array>
#include <cstddef>

#include "firmware/boards/stm32f405/registers.hpp"
#include "protocol/wire/crc32.hpp"

namespace diastole::stm32 {

namespace {

constexpr std::uint32_t kMark = 0xD1A5'701E;
constexpr std::size_t kWords = 7;
static_assert(4 * kWords <= kHandOverBytes - 4);
using Words = std::array<std::uint32_t, kWords>;

volatile std::uint32_t* retained() { return reinterpret_cast<volatile std::uint32_t*>(kRetainedAddress); }

/// Over the words with a zero in the CRC's place, which is left in it.
std::uint32_t crc_of(Words& words) {
  words.back() = 0;
  return wire::crc32({reinterpret_cast<const std::uint8_t*>(words.data()), sizeof words});
}

}  // namespace

std::optional<HandOver> read_hand_over() {
  Words words{};
  for (std::size_t i = 0; i < kWords; ++i)
    words[i] = retained()[i];
  const std::uint32_t crc = words.back();
  if (words[0] != kMark || crc != crc_of(words)) return {};
  return HandOver{static_cast<HandOverCommand>(words[1]), words[2], words[3],
                  static_cast<wire::ResetCause>(words[4]), words[5]};
}

void write_hand_over(const HandOver& hand_over) {
  Words words{kMark,
              static_cast<std::uint32_t>(hand_over.command),
              hand_over.slot,
              hand_over.trial,
              static_cast<std::uint32_t>(hand_over.reset_cause),
              hand_over.starts,
              0};
  words.back() = crc_of(words);
  for (std::size_t i = 0; i < kWords; ++i)
    retained()[i] = words[i];
}

void reset() {
  asm volatile("dsb" ::: "memory");
  system_control().AIRCR.write(0x05FA'0004);
  for (;;) {
  }
}

}  // namespace diastole::stm32
