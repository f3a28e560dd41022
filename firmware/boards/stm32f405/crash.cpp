#include "firmware/boards/stm32f405/crash.hpp"

#include <array>
#include <cstddef>
#include <span>
#include <type_traits>

#include "firmware/boards/stm32f405/memory_map.hpp"
#include "firmware/boards/stm32f405/registers.hpp"
#include "protocol/wire/crc32.hpp"

extern "C" std::uint32_t __stack_guard[], __stack_top[];

namespace diastole::stm32 {

namespace {

constexpr std::uint32_t kMark = 0xC4A5'4001;

/// Plain words: what has a constructor would be begun anew at each start.
struct Kept {
  std::uint32_t mark;
  std::array<std::uint32_t, wire::kCrashRegisters> values;
  std::uint32_t crc;
};
static_assert(std::is_trivially_default_constructible_v<Kept>);

/// Not written at start-up.
[[gnu::section(".retained")]] Kept kept;

std::uint32_t crc_of(const firmware::CrashRecord& record) {
  return wire::crc32({reinterpret_cast<const std::uint8_t*>(&record), sizeof record});
}

/// Whether the core has stacked its registers there: MSTKERR and STKERR say that it could not.
bool was_stacked(const std::uint32_t* frame, std::uint32_t cfsr) {
  constexpr std::uint32_t kNotStacked = 1U << 4 | 1U << 12;
  constexpr std::ptrdiff_t kFrameWords = 8, kGuardWords = 1024;
  return (cfsr & kNotStacked) == 0 && frame >= __stack_guard + kGuardWords &&
         __stack_top - frame >= kFrameWords;
}

}  // namespace

void keep_crash(const std::uint32_t* frame) {
  using enum wire::CrashRegister;
  firmware::CrashRecord record;
  constexpr std::uint32_t kActive = 0x1FF;
  record[exception] = system_control().ICSR.read() & kActive;
  record[cfsr] = system_control().CFSR.read();
  record[hfsr] = system_control().HFSR.read();
  record[mmfar] = system_control().MMFAR.read();
  record[bfar] = system_control().BFAR.read();
  record[cycles] = cycle_counter().CYCCNT.read();
  record[sp] = static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(frame));
  if (was_stacked(frame, record[cfsr])) {
    constexpr wire::CrashRegister kFrame[] = {r0, r1, r2, r3, r12, lr, pc, psr};
    for (const wire::CrashRegister which : kFrame)
      record[which] = *frame++;
  }
  kept = {kMark, record.values, crc_of(record)};
}

std::optional<firmware::CrashRecord> take_crash() {
  const firmware::CrashRecord record{kept.values};
  if (kept.mark != kMark || kept.crc != crc_of(record)) return {};
  kept.mark = 0;
  return record;
}

void start_cycle_counter() {
  debug_monitor().set(1U << 24);  // TRCENA
  cycle_counter().CYCCNT.write(0);
  cycle_counter().CTRL.set(1U);
}

}  // namespace diastole::stm32
