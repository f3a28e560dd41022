// Signatures that are nearly right, and points that are none of an honest signer's, before the code that the bootloader judges
// with. RFC 8032, 5.1.7: S is below L; L is the order of the base point.

#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <random>
#include <string>
#include <vector>

#include "protocol/signing/ed25519.hpp"

extern "C" {
#include <ed25519.h>
}

namespace diastole::signing {
namespace {

using Number = std::array<std::uint8_t, 32>;  // little-endian

constexpr Number order{0xed, 0xd3, 0xf5, 0x5c, 0x1a, 0x63, 0x12, 0x58, 0xd6, 0x9c, 0xf7,
                       0xa2, 0xde, 0xf9, 0xde, 0x14, 0,    0,    0,    0,    0,    0,
                       0,    0,    0,    0,    0,    0,    0,    0,    0,    0x10};

/// The sum; false if it has more than 256 bits.
bool add(Number& sum, const Number& other) {
  unsigned carry = 0;
  for (std::size_t i = 0; i < sum.size(); ++i) {
    carry += unsigned{sum[i]} + other[i];
    sum[i] = static_cast<std::uint8_t>(carry & 0xffU);
    carry >>= 8;
  }
  return carry == 0;
}

Number scalar_of(const Signature& signature) {
  Number scalar{};
  std::copy_n(signature.begin() + 32, scalar.size(), scalar.begin());
  return scalar;
}

Signature with(Signature signature, const Number* point, const Number* scalar) {
  if (point != nullptr) std::copy(point->begin(), point->end(), signature.begin());
  if (scalar != nullptr) std::copy(scalar->begin(), scalar->end(), signature.begin() + 32);
  return signature;
}

struct Signed {
  SecretKey secret{};
  std::vector<std::uint8_t> message;
  PublicKey key{};
  Signature signature{};
};

Signed drawn(std::mt19937& random) {
  Signed all;
  for (auto& byte : all.secret)
    byte = static_cast<std::uint8_t>(random());
  all.message.resize(72);
  for (auto& byte : all.message)
    byte = static_cast<std::uint8_t>(random());
  all.key = public_key_of(all.secret);
  all.signature = sign(all.secret, all.message);
  return all;
}

/// Every encoding of a point whose order divides 8, with the sign bit and beyond p too.
std::vector<Number> small_order_points() {
  const char* const texts[] = {"0000000000000000000000000000000000000000000000000000000000000000",
                               "0100000000000000000000000000000000000000000000000000000000000000",
                               "26e8958fc2b227b045c3f489f2ef98f0d5dfac05d3c63339b13802886d53fc05",
                               "c7176a703d4dd84fba3c0b760d10670f2a2053fa2c39ccc64ec7fd7792ac037a",
                               "ecffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
                               "edffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f",
                               "eeffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff7f"};
  std::vector<Number> points;
  for (const std::string text : texts) {
    Number point{};
    for (std::size_t i = 0; i < point.size(); ++i)
      point[i] = static_cast<std::uint8_t>(std::stoul(text.substr(2 * i, 2), nullptr, 16));
    points.push_back(point);
    point[31] |= 0x80;
    points.push_back(point);
  }
  return points;
}

/// Whether eight times the point is the neutral element.
bool of_small_order(const Number& packed) {
  std::array<std::uint8_t, 32> x{}, y{};
  (void)ed25519_try_unpack(x.data(), y.data(), packed.data());
  ed25519_pt point{};
  ed25519_project(&point, x.data(), y.data());
  for (int i = 0; i < 3; ++i)
    ed25519_double(&point, &point);
  ed25519_unproject(x.data(), y.data(), &point);
  Number again{};
  ed25519_pack(again.data(), x.data(), y.data());
  return again == Number{1};
}

TEST(Ed25519Edges, NoMultipleOfTheOrderMayBeAddedToS) {
  std::mt19937 random(8032);
  int refused = 0;
  for (int round = 0; round < 5; ++round) {
    const Signed all = drawn(random);
    ASSERT_TRUE(signature_holds(all.key, all.message, all.signature));
    for (Number scalar = scalar_of(all.signature); add(scalar, order); ++refused)
      ASSERT_FALSE(signature_holds(all.key, all.message, with(all.signature, nullptr, &scalar)));
  }
  EXPECT_GE(refused, 5 * 14) << "2^256 / L is 15.99";
}

TEST(Ed25519Edges, SIsRefusedFromTheOrderOn) {
  std::mt19937 random(252);
  const Signed all = drawn(random);
  Number greatest{};
  greatest.fill(0xff);
  for (const Number& scalar : {order, greatest})
    EXPECT_FALSE(signature_holds(all.key, all.message, with(all.signature, nullptr, &scalar)));
  // The neutral element and S = 0 or L: SB = R, so only zA stands between this and a signature.
  const Number neutral{1}, zero{};
  for (const Number& scalar : {zero, order})
    EXPECT_FALSE(signature_holds(all.key, all.message, with(all.signature, &neutral, &scalar)));
}

TEST(Ed25519Edges, NoPointOfSmallOrderStandsForR) {
  std::mt19937 random(8);
  for (const Number& point : small_order_points()) {
    ASSERT_TRUE(of_small_order(point));
    for (int round = 0; round < 2; ++round) {
      const Signed all = drawn(random);
      const Number zero{};
      ASSERT_FALSE(signature_holds(all.key, all.message, with(all.signature, &point, &zero)));
      ASSERT_FALSE(signature_holds(all.key, all.message, with(all.signature, &point, nullptr)));
    }
  }
}

/// A key of small order vouches for anything; none comes of a secret, and no other way leads into the bootloader.
TEST(Ed25519Edges, NoSecretMakesAKeyOfSmallOrder) {
  std::mt19937 random(4);
  SecretKey all_ones{};
  all_ones.fill(0xff);
  for (const SecretKey& secret : {SecretKey{}, all_ones})
    EXPECT_FALSE(of_small_order(public_key_of(secret)));
  for (int round = 0; round < 40; ++round)
    ASSERT_FALSE(of_small_order(drawn(random).key));
}

TEST(Ed25519Edges, WhatIsNoPointIsRefused) {
  std::mt19937 random(3);
  const Signed all = drawn(random);
  int no_points = 0;
  for (int round = 0; round < 24; ++round) {
    Number packed{};
    for (auto& byte : packed)
      byte = static_cast<std::uint8_t>(random());
    std::array<std::uint8_t, 32> x{}, y{};
    no_points += ed25519_try_unpack(x.data(), y.data(), packed.data()) == 0 ? 1 : 0;
    ASSERT_FALSE(signature_holds(all.key, all.message, with(all.signature, &packed, nullptr)));
    ASSERT_FALSE(signature_holds(packed, all.message, all.signature));
  }
  EXPECT_GT(no_points, 5) << "every second of them";
}

}  // namespace
}  // namespace diastole::signing
