#pragma once
// SHA-256 (FIPS 180-4), freestanding: what an image is recognised and checked by. About 1 KB of flash, 112
// bytes of state, no table in RAM.
//
//   Sha256 hash;
//   hash.add(header);
//   hash.add(code);
//   Digest digest = hash.digest();

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace diastole::wire {

using Digest = std::array<std::uint8_t, 32>;

class Sha256 {
 public:
  void add(std::span<const std::uint8_t> bytes);
  /// Of everything added so far; ends the hash, which must not be added to afterwards.
  [[nodiscard]] Digest digest();

 private:
  void add_byte(std::uint8_t byte);
  void compress(const std::uint8_t* block);

  std::array<std::uint32_t, 8> state_{0x6A09'E667, 0xBB67'AE85, 0x3C6E'F372, 0xA54F'F53A,
                                      0x510E'527F, 0x9B05'688C, 0x1F83'D9AB, 0x5BE0'CD19};
  std::array<std::uint8_t, 64> block_{};
  std::size_t filled_ = 0;
  std::uint64_t bytes_ = 0;
};

inline Digest sha256(std::span<const std::uint8_t> bytes) {
  Sha256 hash;
  hash.add(bytes);
  return hash.digest();
}

}  // namespace diastole::wire
