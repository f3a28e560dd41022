// Loads from an address that holds nothing. BUS takes the BusFault itself, else it escalates; TWICE faults in
// the handler.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
void note() {
  seen[1] = at(0xe000ed28);
  seen[2] = at(0xe000ed2c);
  seen[3] = at(0xe000ed38);
  uint32_t ipsr = 0;
  asm volatile("mrs %0, ipsr" : "=r"(ipsr));
  seen[4] = ipsr;
}
}  // namespace

extern "C" void hard_fault() {
  note();
#ifdef TWICE
  seen[5] = at(0x60000000);
#endif
  for (;;) {
  }
}

extern "C" void bus_fault() {
  note();
  for (;;) {
  }
}

extern "C" void image() {
#ifdef BUS
  at(0xe000ed24) = 1 << 17;
#endif
  seen[0] = 1;
  seen[5] = at(0x30000000);
  seen[6] = 1;
}
