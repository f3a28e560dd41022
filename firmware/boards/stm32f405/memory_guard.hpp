#pragma once
// The memory protection unit (PM0214 4.2): RAM is data, and a page below the stack is nobody's.
//
//   0x2000'0000  static data | free … | guard, 4 KB | stack, 8 KB | retained, 4 KB
//                                       __stack_guard               region 0 over all: read, write, never executed
//
// A stack that grows beyond its 8 KB, and a jump into RAM, are a MemManage fault where they happen. With it on, usage and
// bus faults are distinguished from hard faults.

#include <cstdint>

#include "firmware/boards/stm32f405/registers.hpp"

extern "C" std::uint32_t __stack_guard[];

namespace diastole::stm32 {

inline void guard_memory() {
  constexpr std::uint32_t kNeverExecute = 1U << 28, kReadWrite = 3U << 24, kMemoryOfTheChip = 6U << 16,
                          kEnable = 1U;
  constexpr std::uint32_t kBytes128K = 16U << 1, kBytes4K = 11U << 1, kThisRegion = 1U << 4;
  mpu().RBAR.write(0x2000'0000U | kThisRegion | 0U);
  mpu().RASR.write(kNeverExecute | kReadWrite | kMemoryOfTheChip | kBytes128K | kEnable);
  mpu().RBAR.write(static_cast<std::uint32_t>(reinterpret_cast<std::uintptr_t>(__stack_guard)) | kThisRegion |
                   1U);
  mpu().RASR.write(kNeverExecute | kMemoryOfTheChip | kBytes4K | kEnable);
  constexpr std::uint32_t kDefaultMapElsewhere = 1U << 2;
  mpu().CTRL.write(kDefaultMapElsewhere | kEnable);
  system_control().SHCSR.set(7U << 16);  // MemManage, bus and usage faults of their own
  asm volatile("dsb \n isb" ::: "memory");
}

}  // namespace diastole::stm32
