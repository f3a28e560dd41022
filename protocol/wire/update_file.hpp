#pragma once
// The file that `diastole flash` takes, build/firmware/bin/diastole-stm32f405.image: the application linked
// for either slot, because it is executed in place and the controller decides which slot is free.
//
//   offset        size  field
//        0           8  magic        "DIASTOLE"
//        8           2  file_version 2
//       10           2  images       2
//       12           4  file_bytes   length of the whole file
//       16               the images, slot A's first; each:
//                   64  header       image_header.hpp
//                   72  signature    image_signature.hpp; not in files of version 1, which are not signed
//           code_bytes  code         padded by its linker to a multiple of 4
//     last          32  sha256       of everything before
//
// Integers are little-endian.

#include <array>
#include <cstddef>
#include <cstdint>

namespace diastole::wire {

inline constexpr std::array<std::uint8_t, 8> kUpdateFileMagic{'D', 'I', 'A', 'S', 'T', 'O', 'L', 'E'};
inline constexpr std::uint16_t kUpdateFileVersion = 2;
inline constexpr std::uint16_t kUpdateFileImages = 2;
inline constexpr std::size_t kUpdateFileHeadBytes = 16;

}  // namespace diastole::wire
