// An application that starts and does nothing: the watchdog that the bootloader started ends it.

extern "C" {
void Stray_Handler() {}
int main() { return 0; }
}
