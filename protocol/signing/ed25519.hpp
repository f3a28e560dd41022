#pragma once
// Ed25519 (RFC 8032) by third_party/c25519, for bootloader, packer and host.

#include <array>
#include <cstdint>
#include <span>

extern "C" {
#include <edsign.h>
}

namespace diastole::signing {

using PublicKey = std::array<std::uint8_t, EDSIGN_PUBLIC_KEY_SIZE>;
using SecretKey = std::array<std::uint8_t, EDSIGN_SECRET_KEY_SIZE>;
using Signature = std::array<std::uint8_t, EDSIGN_SIGNATURE_SIZE>;

/// Whether who has the key's secret has signed the message. RFC 8032 (5.1.7) wants S below the order L = 2^252 + 2.8e37, which
/// edsign_verify does not ask: of S + L, 2 L ... it would take fourteen more. Taken here is S below 2^252, which one signature
/// in 5e37 is not. A key of small order vouches for anything; none comes of a secret.
inline bool signature_holds(std::span<const std::uint8_t, EDSIGN_PUBLIC_KEY_SIZE> key,
                            std::span<const std::uint8_t> message,
                            std::span<const std::uint8_t, EDSIGN_SIGNATURE_SIZE> signature) {
  constexpr std::uint8_t kFrom2To252 = 0xF0;
  if ((signature.back() & kFrom2To252) != 0) return false;
  return edsign_verify(signature.data(), key.data(), message.data(), message.size()) != 0;
}

inline PublicKey public_key_of(const SecretKey& secret) {
  PublicKey key{};
  edsign_sec_to_pub(key.data(), secret.data());
  return key;
}

inline Signature sign(const SecretKey& secret, std::span<const std::uint8_t> message) {
  const PublicKey key = public_key_of(secret);
  Signature signature{};
  edsign_sign(signature.data(), key.data(), secret.data(), message.data(), message.size());
  return signature;
}

}  // namespace diastole::signing
