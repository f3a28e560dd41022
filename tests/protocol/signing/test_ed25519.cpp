// Ed25519 against the vectors of RFC 8032, 7.1, and against OpenSSL, which shares no line with it.

#include "protocol/signing/ed25519.hpp"

#include <gtest/gtest.h>
#include <openssl/evp.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace diastole::signing {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes of_hex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i < text.size(); i += 2)
    bytes.push_back(static_cast<std::uint8_t>(std::stoul(text.substr(i, 2), nullptr, 16)));
  return bytes;
}

template <class Array>
Array array_of(const std::string& hex) {
  const Bytes bytes = of_hex(hex);
  Array array{};
  EXPECT_EQ(bytes.size(), array.size());
  std::copy_n(bytes.begin(), array.size(), array.begin());
  return array;
}

struct KnownAnswer {
  const char *name, *secret, *open, *message, *signature;
};

const KnownAnswer rfc_8032[] = {
    {"TEST 1", "9d61b19deffd5a60ba844af492ec2cc44449c5697b326919703bac031cae7f60",
     "d75a980182b10ab7d54bfed3c964073a0ee172f3daa62325af021a68f707511a", "",
     "e5564300c360ac729086e2cc806e828a84877f1eb8e5d974d873e065224901555fb8821590a33bacc61e39701cf9b46b"
     "d25bf5f0595bbe24655141438e7a100b"},
    {"TEST 2", "4ccd089b28ff96da9db6c346ec114e0f5b8a319f35aba624da8cf6ed4fb8a6fb",
     "3d4017c3e843895a92b70aa74d1b7ebc9c982ccf2ec4968cc0cd55f12af4660c", "72",
     "92a009a9f0d4cab8720e820b5f642540a2b27b5416503f8fb3762223ebdb69da085ac1e43e15996e458f3613d0f11d8c"
     "387b2eaeb4302aeeb00d291612bb0c00"},
    {"TEST 3", "c5aa8df43f9f837bedb7442f31dcb7b166d38535076f094b85ce3a2e0b4458f7",
     "fc51cd8e6218a1a38da47ed00230f0580816ed13ba3303ac5deb911548908025", "af82",
     "6291d657deec24024827e69c3abe01a30ce548a284743a445e3680d7db5ac3ac18ff9b538d16f290ae67f760984dc659"
     "4a7c15e9716ed28dc027beceea1ec40a"},
    {"TEST SHA(abc)", "833fe62409237b9d62ec77587520911e9a759cec1d19755b7da901b96dca3d42",
     "ec172b93ad5e563bf4932c70e1245034c35467ef2efd4d64ebf819683467e2bf",
     "ddaf35a193617abacc417349ae20413112e6fa4e89a97ea20a9eeee64b55d39a2192992a274fc1a836ba3c23a3feebbd"
     "454d4423643ce80e2a9ac94fa54ca49f",
     "dc2a4459e7369633a52b1bf277839a00201009a3efbf3ecb69bea2186c26b58909351fc9ac90b3ecfdfbc7c66431e030"
     "3dca179c138ac17ad9bef1177331a704"},
};

TEST(Ed25519, GivesTheAnswersOfRfc8032) {
  for (const KnownAnswer& known : rfc_8032) {
    SCOPED_TRACE(known.name);
    const auto secret = array_of<SecretKey>(known.secret);
    const Bytes message = of_hex(known.message);
    const auto signature = array_of<Signature>(known.signature);
    EXPECT_EQ(public_key_of(secret), array_of<PublicKey>(known.open));
    EXPECT_EQ(sign(secret, message), signature);
    EXPECT_TRUE(signature_holds(array_of<PublicKey>(known.open), message, signature));
  }
}

TEST(Ed25519, NoticesEveryFlippedBitOfKeyMessageAndSignature) {
  const KnownAnswer& known = rfc_8032[2];
  const auto key = array_of<PublicKey>(known.open);
  const auto signature = array_of<Signature>(known.signature);
  const Bytes message = of_hex(known.message);
  const auto flip = [](auto bytes, std::size_t bit) {
    bytes[bit / 8] = static_cast<std::uint8_t>(bytes[bit / 8] ^ 1U << bit % 8);
    return bytes;
  };
  for (std::size_t bit = 0; bit < 8 * signature.size(); ++bit)
    ASSERT_FALSE(signature_holds(key, message, flip(signature, bit))) << "signature, bit " << bit;
  for (std::size_t bit = 0; bit < 8 * key.size(); ++bit)
    ASSERT_FALSE(signature_holds(flip(key, bit), message, signature)) << "key, bit " << bit;
  for (std::size_t bit = 0; bit < 8 * message.size(); ++bit)
    ASSERT_FALSE(signature_holds(key, flip(message, bit), signature)) << "message, bit " << bit;
}

Signature signed_by_openssl(const SecretKey& secret, const Bytes& message) {
  const std::unique_ptr<EVP_PKEY, decltype(&EVP_PKEY_free)> key(
      EVP_PKEY_new_raw_private_key(EVP_PKEY_ED25519, nullptr, secret.data(), secret.size()), EVP_PKEY_free);
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(), EVP_MD_CTX_free);
  Signature signature{};
  std::size_t size = signature.size();
  EXPECT_EQ(EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, key.get()), 1);
  EXPECT_EQ(EVP_DigestSign(context.get(), signature.data(), &size, message.data(), message.size()), 1);
  return signature;
}

TEST(Ed25519, SignsAsOpenSslDoes) {
  std::mt19937 random(25519);
  for (int round = 0; round < 200; ++round) {
    SecretKey secret{};
    for (auto& byte : secret)
      byte = static_cast<std::uint8_t>(random());
    Bytes message(random() % 300);
    for (auto& byte : message)
      byte = static_cast<std::uint8_t>(random());
    const Signature signature = sign(secret, message);
    ASSERT_EQ(signature, signed_by_openssl(secret, message)) << "message of " << message.size() << " bytes";
    ASSERT_TRUE(signature_holds(public_key_of(secret), message, signature));
  }
}

extern "C" void f25519_mul__distinct(std::uint8_t* r, const std::uint8_t* a, const std::uint8_t* b);

/// a b mod 2^255 - 19 by shifting and adding bytes, for the function of c25519 that is not as it came.
Bytes slow_product(const Bytes& a, const Bytes& b) {
  std::vector<std::uint64_t> sum(64);
  for (std::size_t i = 0; i < 32; ++i)
    for (std::size_t j = 0; j < 32; ++j)
      sum[i + j] += std::uint64_t{a[i]} * b[j];
  for (std::size_t i = 0; i < 32; ++i)
    sum[i] += 38 * sum[i + 32];
  sum.resize(32);
  for (int again = 0; again < 3; ++again) {
    std::uint64_t carry = 0;
    for (auto& digit : sum) {
      carry += digit;
      digit = carry & 0xFF;
      carry >>= 8;
    }
    sum[0] += 38 * carry;
  }
  return {sum.begin(), sum.end()};
}

extern "C" void f25519_normalize(std::uint8_t* x);

TEST(Ed25519, MultipliesByWordsAsByBytes) {
  std::mt19937 random(19);
  for (int round = 0; round < 20'000; ++round) {
    Bytes a(32), b(32), product(32);
    for (Bytes* each : {&a, &b})
      for (auto& byte : *each)
        byte = random() % 3 == 0 ? std::uint8_t{0xFF} : static_cast<std::uint8_t>(random());
    f25519_mul__distinct(product.data(), a.data(), b.data());
    Bytes expected = slow_product(a, b);
    f25519_normalize(product.data());
    f25519_normalize(expected.data());
    ASSERT_EQ(product, expected) << round;
  }
  const Bytes greatest(32, 0xFF);
  Bytes product(32), expected = slow_product(greatest, greatest);
  f25519_mul__distinct(product.data(), greatest.data(), greatest.data());
  f25519_normalize(product.data());
  f25519_normalize(expected.data());
  EXPECT_EQ(product, expected);
}

}  // namespace
}  // namespace diastole::signing
