#include "protocol/wire/image_header.hpp"

#include <gtest/gtest.h>

#include <array>

namespace diastole::wire {
namespace {

constexpr std::array<std::uint8_t, 4> code{1, 2, 3, 4};

ImageHeader example() {
  ImageHeader header;
  header.board_id = 2;
  header.link_address = 0x0802'0000;
  header.code_bytes = code.size();
  header.version = {0, 1, 0};
  header.build_id = 0x1122'3344'5566'7788;
  header.sha256 = digest_of(header, code);
  return header;
}

// The example drawn in image_header.hpp.
TEST(ImageHeader, EncodesToTheBytesInItsHeader) {
  const ImageHeaderBytes expected{
      0x44, 0x49, 0x4D, 0x47, 0x01, 0x00, 0x02, 0x00, 0x00, 0x00, 0x02, 0x08, 0x04, 0x00, 0x00, 0x00,
      0x00, 0x01, 0x00, 0x00, 0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11, 0x4D, 0x0C, 0xA3, 0x20,
      0x5F, 0xF8, 0x5D, 0xE1, 0xB2, 0x18, 0xA2, 0xE1, 0x7E, 0x83, 0x88, 0x98, 0xA9, 0x11, 0x2B, 0x98,
      0x7C, 0xB4, 0xE5, 0xC0, 0xAA, 0x87, 0xDC, 0xFA, 0xCF, 0xDF, 0x75, 0x64, 0xA6, 0x5A, 0x77, 0x8F};
  EXPECT_EQ(encode(example()), expected);
  EXPECT_EQ(decode_image_header(expected), example());
}

TEST(ImageHeader, AnyFlippedBitIsNoticed) {
  const ImageHeaderBytes whole = encode(example());
  for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
    ImageHeaderBytes flipped = whole;
    flipped[bit / 8] = static_cast<std::uint8_t>(flipped[bit / 8] ^ 1U << bit % 8);
    ASSERT_FALSE(decode_image_header(flipped)) << "bit " << bit;
  }
}

TEST(ImageHeader, ErasedOrClearedFlashIsNone) {
  ImageHeaderBytes bytes;
  bytes.fill(0xFF);
  EXPECT_FALSE(decode_image_header(bytes));
  bytes.fill(0);
  EXPECT_FALSE(decode_image_header(bytes));
}

TEST(ImageHeader, TheDigestCoversHeaderAndCode) {
  ImageHeader other = example();
  other.version.patch = 1;
  EXPECT_NE(digest_of(other, code), example().sha256);
  EXPECT_NE(digest_of(example(), std::span(code).first(3)), example().sha256);
}

}  // namespace
}  // namespace diastole::wire
