#pragma once
// What stands in front of an application in its slot. The slot's first kImageHeaderArea bytes are the
// header's, the application's vector table follows; hence it lies on a multiple of 512, as VTOR demands.
//
//   offset  size  field
//        0     4  magic           "DIMG"
//        4     2  header_version  1
//        6     2  board_id        as in Hello: 2 STM32F405
//        8     4  link_address    of the slot for which the application is linked
//       12     4  code_bytes      length of the application, from link_address + 512 on
//       16     1  version_major
//       17     1  version_minor
//       18     1  version_patch
//       19     1  0
//       20     8  build_id        the same in the images of one build for either slot
//       28    32  sha256          of bytes 0 ... 27 and the application's code_bytes
//       60     4  crc             CRC-32 (crc32.hpp) of bytes 0 ... 59: a header, not its remains
//
// Integers are little-endian; the 448 bytes up to the application stay erased (0xFF).
//
//   Example: version 0.1.0 for slot A, code 01 02 03 04, build id 0x1122334455667788
//     44 49 4D 47 01 00 02 00 00 00 02 08 04 00 00 00 00 01 00 00 88 77 66 55 44 33 22 11
//     4D 0C A3 20 5F F8 5D E1 B2 18 A2 E1 7E 83 88 98 A9 11 2B 98 7C B4 E5 C0 AA 87 DC FA CF DF 75 64
//     A6 5A 77 8F
//
// This layout never changes: a bootloader outlives the images that it starts.

#include <algorithm>
#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/crc32.hpp"
#include "protocol/wire/sha256.hpp"

namespace diastole::wire {

inline constexpr std::size_t kImageHeaderBytes = 64;
inline constexpr std::size_t kImageHeaderArea = 512;
inline constexpr std::uint16_t kImageHeaderVersion = 1;
inline constexpr std::size_t kCodeBytesAt = 12;

struct FirmwareVersion {
  std::uint8_t major = 0, minor = 0, patch = 0;
  auto operator<=>(const FirmwareVersion&) const = default;
};

/// As one number, 0x00MMmmpp.
constexpr std::uint32_t packed(FirmwareVersion version) {
  return static_cast<std::uint32_t>(version.major) << 16 | static_cast<std::uint32_t>(version.minor) << 8 |
         version.patch;
}

struct ImageHeader {
  std::uint16_t board_id = 0;
  std::uint32_t link_address = 0;
  std::uint32_t code_bytes = 0;
  FirmwareVersion version;
  std::uint64_t build_id = 0;
  Digest sha256{};

  bool operator==(const ImageHeader&) const = default;
};

using ImageHeaderBytes = std::array<std::uint8_t, kImageHeaderBytes>;

namespace detail {

inline constexpr std::size_t kHashedHeaderBytes = 28, kHeaderCrcAt = 60;
inline constexpr std::array<std::uint8_t, 4> kImageMagic{'D', 'I', 'M', 'G'};

template <class Integer>
constexpr void put_little(std::span<std::uint8_t> out, Integer value) {
  for (std::size_t i = 0; i < sizeof(Integer); ++i)
    out[i] = static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * i));
}
template <class Integer>
constexpr Integer get_little(std::span<const std::uint8_t> in) {
  std::uint64_t value = 0;
  for (std::size_t i = sizeof(Integer); i-- > 0;)
    value = value << 8 | in[i];
  return static_cast<Integer>(value);
}

}  // namespace detail

constexpr ImageHeaderBytes encode(const ImageHeader& header) {
  ImageHeaderBytes bytes{};
  const std::span out(bytes);
  std::copy(detail::kImageMagic.begin(), detail::kImageMagic.end(), bytes.begin());
  detail::put_little(out.subspan(4), kImageHeaderVersion);
  detail::put_little(out.subspan(6), header.board_id);
  detail::put_little(out.subspan(8), header.link_address);
  detail::put_little(out.subspan(kCodeBytesAt), header.code_bytes);
  bytes[16] = header.version.major;
  bytes[17] = header.version.minor;
  bytes[18] = header.version.patch;
  detail::put_little(out.subspan(20), header.build_id);
  std::copy(header.sha256.begin(), header.sha256.end(), bytes.begin() + detail::kHashedHeaderBytes);
  detail::put_little(out.subspan(detail::kHeaderCrcAt), crc32(out.first(detail::kHeaderCrcAt)));
  return bytes;
}

/// Nothing if the bytes are not a whole header of this version; says nothing about the code.
constexpr std::optional<ImageHeader> decode_image_header(
    std::span<const std::uint8_t, kImageHeaderBytes> bytes) {
  if (!std::equal(detail::kImageMagic.begin(), detail::kImageMagic.end(), bytes.begin()) ||
      detail::get_little<std::uint16_t>(bytes.subspan(4)) != kImageHeaderVersion || bytes[19] != 0 ||
      detail::get_little<std::uint32_t>(bytes.subspan(detail::kHeaderCrcAt)) !=
          crc32(bytes.first(detail::kHeaderCrcAt)))
    return {};
  ImageHeader header;
  header.board_id = detail::get_little<std::uint16_t>(bytes.subspan(6));
  header.link_address = detail::get_little<std::uint32_t>(bytes.subspan(8));
  header.code_bytes = detail::get_little<std::uint32_t>(bytes.subspan(kCodeBytesAt));
  header.version = {bytes[16], bytes[17], bytes[18]};
  header.build_id = detail::get_little<std::uint64_t>(bytes.subspan(20));
  std::copy_n(bytes.begin() + detail::kHashedHeaderBytes, header.sha256.size(), header.sha256.begin());
  return header;
}

/// What ImageHeader::sha256 must be for this code behind this header.
inline Digest digest_of(std::span<const std::uint8_t, kImageHeaderBytes> header,
                        std::span<const std::uint8_t> code) {
  Sha256 hash;
  hash.add(header.first(detail::kHashedHeaderBytes));
  hash.add(code);
  return hash.digest();
}
inline Digest digest_of(const ImageHeader& header, std::span<const std::uint8_t> code) {
  return digest_of(encode(header), code);
}

}  // namespace diastole::wire
