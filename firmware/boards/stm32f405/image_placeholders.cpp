// Room for what the build fills in after linking (CMakeLists.txt): the image's header, and in the whole factory
// image the bootloader's record that slot A is confirmed.

#include "firmware/boot/boot_records.hpp"

namespace {

using namespace diastole;

[[gnu::section(".image_header"), gnu::used]] const wire::ImageHeaderBytes header{};
#ifdef DIASTOLE_BOOTLOADER_BIN
[[gnu::section(".boot_records"), gnu::used]] const boot::RecordBytes record{};
asm(".section .bootloader,\"a\",%progbits\n"
    ".incbin \"" DIASTOLE_BOOTLOADER_BIN
    "\"\n"
    ".previous\n");
#endif

}  // namespace
