// Signatures on the emulated board: what the image's bootloader refuses, and how long it takes to check.

#include <gmock/gmock.h>

#include <fstream>

#include "protocol/signing/signing_key.hpp"
#include "tests/tools/sim_board/flash_bench.hpp"

namespace diastole::sim_board_test {
namespace {

using ::testing::HasSubstr;

/// Of the key file that the firmware was built with; there is none if it was built without.
const std::string key_file = [] {
  std::ifstream file(built + "signing-key.path");
  std::string path;
  std::getline(file, path);
  return path;
}();

#define NEEDS_KEY()                                                \
  NEEDS_UPDATE_IMAGES();                                           \
  if (!std::filesystem::exists(key_file))                          \
  GTEST_SKIP() << "the firmware was not built with a key that is " \
                  "here"

UpdateFile signed_with(UpdateFile file, const signing::SecretKey& key, uint32_t counter) {
  for (SlotImage& image : file.images)
    image.signature = {counter, signing::sign(key, wire::signed_bytes(wire::encode(image.header), counter))};
  return file;
}

std::string refusal(FlashBench& bench, const UpdateFile& file) {
  try {
    (void)bench.flash(file, {.allow_older = true});
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(SignedFlashing, RefusesWhatTheKeyDoesNotVouchFor) {
  NEEDS_KEY();
  FlashBench bench;
  UpdateFile file = read_update_file(newer_update);
  for (SlotImage& image : file.images)
    image.signature = {};
  EXPECT_THAT(refusal(bench, file), HasSubstr("is not signed"));
  EXPECT_THAT(refusal(bench, signed_with(file, {1, 2, 3}, 0)), HasSubstr("signed with another key"));
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "0.1.0 confirmed");
}

/// On the chip the curve's multiplication is other code than on this machine. Each of these is judged by the bootloader itself.
TEST(SignedFlashing, RefusesSignaturesThatAreNearlyRight) {
  NEEDS_KEY();
  FlashBench bench;
  const UpdateFile good = signed_with(read_update_file(newer_update), signing::read_key_file(key_file), 0);
  const auto refusal_with = [&](auto&& change) {
    UpdateFile file = good;
    for (SlotImage& image : file.images)
      change(image.signature.signature);
    return refusal(bench, file);
  };
  const auto wrong = HasSubstr("signed with another key");
  for (const size_t bit : {0U, 255U, 256U, 507U})
    EXPECT_THAT(refusal_with([bit](auto& bytes) { bytes[bit / 8] ^= static_cast<uint8_t>(1U << bit % 8); }),
                wrong)
        << bit;
  EXPECT_THAT(refusal_with([](auto& bytes) {  // S + L
                constexpr uint8_t order[] = {0xed, 0xd3, 0xf5, 0x5c, 0x1a, 0x63, 0x12, 0x58,
                                             0xd6, 0x9c, 0xf7, 0xa2, 0xde, 0xf9, 0xde, 0x14};
                unsigned carry = 0;
                for (size_t i = 0; i < 32; ++i, carry >>= 8) {
                  carry += bytes[32 + i] + (i < 16 ? order[i] : i == 31 ? 0x10U : 0U);
                  bytes[32 + i] = static_cast<uint8_t>(carry & 0xff);
                }
              }),
              wrong);
  for (const uint8_t first : std::initializer_list<uint8_t>{0, 1})  // points of order 4 and 1 for R, S = 0
    EXPECT_THAT(refusal_with([first](auto& bytes) { bytes.fill(0), bytes[0] = first; }), wrong);
  EXPECT_EQ(refusal(bench, good), "");
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
}

TEST(SignedFlashing, NeverGoesBelowTheCounterThatItHasConfirmed) {
  NEEDS_KEY();
  FlashBench bench;
  const auto key = signing::read_key_file(key_file);
  ASSERT_EQ(bench.flash(signed_with(read_update_file(newer_update), key, 7)).end, UpdateEnd::confirmed);
  EXPECT_THAT(refusal(bench, read_update_file(first_update)), HasSubstr("counter is below 7"));
  bench.power_cycle();
  EXPECT_EQ(bench.runs(), "0.1.1 confirmed");
}

/// From power-on to the reset with which the bootloader enters the application, in ms.
double decision_ms(FlashBench& bench) {
  const size_t before = bench.board().statistics().resets.size();
  bench.power_cycle();
  (void)bench.running();
  const auto resets = bench.board().statistics().resets;
  EXPECT_EQ(resets.at(before + 1).cause, "software");
  return 1e-6 * static_cast<double>(resets.at(before + 1).time_ns - resets.at(before).time_ns);
}

TEST(SignedFlashing, AStartChecksOneSignature) {
  NEEDS_KEY();
  FlashBench bench;
  ASSERT_EQ(bench.runs(), "0.1.0 confirmed");
  const double with_key = decision_ms(bench);
  bench.board().power_off();
  bench.remove_key();
  const double without = decision_ms(bench);
  std::printf("a start takes %.1f ms with a key, %.1f ms without\n", with_key, without);
  EXPECT_LT(without, 35);
  EXPECT_LT(with_key, 110) << "a host is to see a reset within 200 ms";
  EXPECT_GT(with_key, without);
  UpdateFile unsigned_file = read_update_file(newer_update);
  for (SlotImage& image : unsigned_file.images)
    image.signature = {};
  EXPECT_EQ(bench.flash(unsigned_file).end, UpdateEnd::confirmed);
}

}  // namespace
}  // namespace diastole::sim_board_test
