// Erases sector 2 and programs 16 words there; then tries without PG and with the interface locked.
// seen: 0 first word after erase, 1 last word programmed, 2 status after a store without PG, 3 CR when locked
// again, 4 word over a programmed one (bits only fall), 5 done.

#include "tests/tools/sim_board/images/chip.hpp"

namespace {
volatile uint32_t* const page = reinterpret_cast<volatile uint32_t*>(0x08008000);
void wait() {
  while (flash.sr & 1 << 16) {
  }
}
}  // namespace

extern "C" void image() {
  flash.keyr = 0x45670123;
  flash.keyr = 0xcdef89ab;
  flash.cr = 2 << 8 | 2 << 3 | 1 << 1;
  flash.cr = 2 << 8 | 2 << 3 | 1 << 1 | 1 << 16;
  wait();
  seen[0] = page[0];
  flash.cr = 2 << 8 | 1;
  for (uint32_t i = 0; i < 16; ++i) {
    page[i] = 0x12340000 + i;
    wait();
  }
  seen[1] = page[15];
  page[0] = 0x0f0f0f0f;
  wait();
  seen[4] = page[0];
  flash.cr = 2 << 8;
  page[20] = 0;
  seen[2] = flash.sr;
  flash.cr = flash.cr | 1U << 31;
  seen[3] = flash.cr;
  seen[5] = 1;
}
