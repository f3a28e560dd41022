// An application that starts and does nothing: the watchdog that the bootloader started ends it.

#include <cstdint>

extern "C" {
[[noreturn]] void Stray_Handler(const std::uint32_t*) {
  for (;;) {
  }
}
int main() { return 0; }
}
