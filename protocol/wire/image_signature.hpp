#pragma once
// Who vouches for an image, in its slot right behind the header (image_header.hpp):
//
//   offset  size  field
//       64     4  magic      "DSIG"
//       68     4  counter    an image with a lower one than any confirmed before it is never started
//       72    64  signature  Ed25519 (RFC 8032) of bytes 0 ... 71; erased (0xFF) if nobody has signed
//
// The header holds the SHA-256 of the code: who signs it signs the code. Integers are little-endian.
//
//   Example: counter 3, not signed
//     44 53 49 47 03 00 00 00 FF FF FF FF ... FF
//
// This layout never changes: a bootloader outlives the images that it starts.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "protocol/wire/image_header.hpp"

namespace diastole::wire {

inline constexpr std::size_t kImageSignatureAt = kImageHeaderBytes;
inline constexpr std::size_t kImageSignatureBytes = 72;
using ImageSignatureBytes = std::array<std::uint8_t, kImageSignatureBytes>;
using Ed25519Signature = std::array<std::uint8_t, 64>;
/// Header and signature, as they lie in a slot.
inline constexpr std::size_t kSignedHeaderBytes = kImageHeaderBytes + kImageSignatureBytes;
using SignedHeader = std::span<const std::uint8_t, kSignedHeaderBytes>;
/// What is signed of it: the header, the magic word and the counter.
using SignedBytes = std::array<std::uint8_t, 72>;

struct ImageSignature {
  std::uint32_t counter = 0;
  Ed25519Signature signature = unsigned_signature();

  [[nodiscard]] constexpr bool is_signed() const { return signature != unsigned_signature(); }
  bool operator==(const ImageSignature&) const = default;

 private:
  static constexpr Ed25519Signature unsigned_signature() {
    Ed25519Signature erased{};
    erased.fill(0xFF);
    return erased;
  }
};

namespace detail {
inline constexpr std::array<std::uint8_t, 4> kSignatureMagic{'D', 'S', 'I', 'G'};
inline constexpr std::size_t kSignatureValueAt = 8;
}  // namespace detail

constexpr ImageSignatureBytes encode(const ImageSignature& signature) {
  ImageSignatureBytes bytes{};
  std::copy(detail::kSignatureMagic.begin(), detail::kSignatureMagic.end(), bytes.begin());
  detail::put_little(std::span(bytes).subspan(4), signature.counter);
  std::copy(signature.signature.begin(), signature.signature.end(),
            bytes.begin() + detail::kSignatureValueAt);
  return bytes;
}

/// Nothing if the bytes are no such block.
constexpr std::optional<ImageSignature> decode_image_signature(
    std::span<const std::uint8_t, kImageSignatureBytes> bytes) {
  if (!std::equal(detail::kSignatureMagic.begin(), detail::kSignatureMagic.end(), bytes.begin())) return {};
  ImageSignature signature;
  signature.counter = detail::get_little<std::uint32_t>(bytes.subspan(4));
  std::copy_n(bytes.begin() + detail::kSignatureValueAt, signature.signature.size(),
              signature.signature.begin());
  return signature;
}

/// The same without copies, for the bootloader.
constexpr auto signed_part(SignedHeader header) { return header.first<sizeof(SignedBytes)>(); }
constexpr auto signature_part(SignedHeader header) { return header.last<sizeof(Ed25519Signature)>(); }
constexpr bool has_signature_block(SignedHeader header) {
  return std::equal(detail::kSignatureMagic.begin(), detail::kSignatureMagic.end(),
                    header.begin() + kImageSignatureAt);
}
constexpr std::uint32_t counter_of(SignedHeader header) {
  return detail::get_little<std::uint32_t>(header.subspan<kImageSignatureAt + 4, 4>());
}

/// What ImageSignature::signature signs.
constexpr SignedBytes signed_bytes(const ImageHeaderBytes& header, std::uint32_t counter) {
  SignedBytes bytes{};
  std::copy(header.begin(), header.end(), bytes.begin());
  std::copy(detail::kSignatureMagic.begin(), detail::kSignatureMagic.end(),
            bytes.begin() + kImageSignatureAt);
  detail::put_little(std::span(bytes).subspan(kImageSignatureAt + 4), counter);
  return bytes;
}

}  // namespace diastole::wire
