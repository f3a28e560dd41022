#include "host/flash/update_file.hpp"

#include <gmock/gmock.h>

#include "protocol/contract/input_error.hpp"
#include "tests/host/flash/update_files.hpp"

namespace diastole::flash_test {
namespace {

using ::testing::HasSubstr;

std::string problem_of(const std::vector<uint8_t>& bytes) {
  try {
    (void)parse_update_file("some.image", bytes);
    return "";
  } catch (const InputError& error) {
    return error.what();
  }
}

TEST(UpdateFile, HoldsOneImageForEachSlot) {
  const UpdateFile file = parse_update_file("some.image", make_update_file({2, {1, 2, 3}, 64}));
  EXPECT_EQ(in_words(file.version), "1.2.3");
  EXPECT_EQ(file.board_id, 2);
  ASSERT_EQ(file.images.size(), 2U);
  EXPECT_EQ(file.images[0].header.link_address, 0x0802'0000U);
  EXPECT_EQ(file.images[1].header.link_address, 0x0804'0000U);
  EXPECT_EQ(file.images[0].code.size(), 64U);
}

TEST(UpdateFile, EveryTruncationIsRefused) {
  const auto whole = make_update_file({2, {1, 2, 3}, 64});
  for (size_t size = 0; size < whole.size(); ++size)
    ASSERT_NE(problem_of({whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size)}), "") << size;
  EXPECT_THAT(problem_of({whole.begin(), whole.end() - 1}), HasSubstr("should have"));
}

TEST(UpdateFile, EveryCorruptedByteIsRefused) {
  const auto whole = make_update_file({2, {1, 2, 3}, 64});
  for (size_t at = 0; at < whole.size(); ++at) {
    auto corrupt = whole;
    corrupt[at] ^= 0x40;
    ASSERT_NE(problem_of(corrupt), "") << at;
  }
}

TEST(UpdateFile, OtherFilesAreNamedAsSuch) {
  EXPECT_THAT(problem_of({0x7f, 'E', 'L', 'F', 1, 1, 1, 0}), HasSubstr(".elf are for SWD tools"));
  EXPECT_THROW((void)read_update_file("/no/such.image"), InputError);
  EXPECT_THROW((void)read_update_file("/"), InputError) << "a directory";
}

}  // namespace
}  // namespace diastole::flash_test
