// Files are read up to the length that their kind has, and no memory is taken for more.

#include "protocol/contract/bounded_file.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// Of bytes that the disk need not hold.
void make_file(const std::filesystem::path& file, uint64_t bytes) {
  std::ofstream(file) << "x";
  std::filesystem::resize_file(file, bytes);
}

int64_t most_resident_kB() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return usage.ru_maxrss;
}

TEST(BoundedFile, IsReadWholeUpToItsBound) {
  const Scratch scratch("bounded");
  make_file(scratch / "just", 2 * megabyte);
  EXPECT_EQ(read_bounded_file(scratch / "just", 2 * megabyte).size(), 2 * megabyte);
  make_file(scratch / "empty", 0);
  EXPECT_EQ(read_bounded_file(scratch / "empty", 1), "");
}

TEST(BoundedFile, BeyondItIsRefusedBeforeMemoryIsTaken) {
  const Scratch scratch("bounded");
  make_file(scratch / "long.csv", 4'000 * megabyte);
  const int64_t before_kB = most_resident_kB();
  EXPECT_THAT(message_of<InputError>([&] { (void)read_bounded_file(scratch / "long.csv", most_data_bytes); }),
              AllOf(HasSubstr("long.csv"), HasSubstr("4000000000 bytes"), HasSubstr("512 MB")));
  EXPECT_LT(most_resident_kB() - before_kB, 20'000);
}

TEST(BoundedFile, WithoutASizeEndsAtTheBound) {
  EXPECT_THAT(message_of<InputError>([] { (void)read_bounded_file("/dev/zero", megabyte); }),
              HasSubstr("more than 1000000 bytes"));
}

TEST(BoundedFile, OfSettingsIsHandwritten) {
  const Scratch scratch("bounded");
  make_file(scratch / "rig.toml", most_settings_bytes + 1);
  EXPECT_THAT(message_of<InputError>([&] { (void)TableReader::from_file(scratch / "rig.toml"); }),
              AllOf(HasSubstr("rig.toml"), HasSubstr("4 MB")));
}

TEST(BoundedFile, ThatIsMissingOrAFolderIsToldWithTheRemedy) {
  EXPECT_THAT(message_of<InputError>([] { (void)read_bounded_file("/nowhere", 1, "Make it."); }),
              HasSubstr("Make it."));
  EXPECT_THAT(message_of<InputError>([] { (void)read_bounded_file("/tmp", 1, "Make it."); }),
              HasSubstr("Make it."));
}

}  // namespace
}  // namespace diastole
