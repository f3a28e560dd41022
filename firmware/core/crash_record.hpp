#pragma once
// What a board keeps of a processor fault through the reset that follows it.

#include <array>
#include <cstdint>

#include "protocol/wire/black_box_messages.hpp"

namespace diastole::firmware {

struct CrashRecord {
  std::array<std::uint32_t, wire::kCrashRegisters> values{};

  [[nodiscard]] std::uint32_t& operator[](wire::CrashRegister which) {
    return values[static_cast<std::size_t>(which)];
  }
  bool operator==(const CrashRecord&) const = default;
};

}  // namespace diastole::firmware
