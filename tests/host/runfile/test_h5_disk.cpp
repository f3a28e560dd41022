// A disk that fills at any write of a run file: told, and the HDF5 library knows nothing of it.

#include "host/runfile/h5_disk.hpp"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/mman.h>

#include <algorithm>
#include <cmath>

#include "host/runfile/h5_sink.hpp"
#include "host/transport/descriptor.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_source.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

constexpr size_t rows = 20'000;

/// A file of all kinds of objects, some megabytes of them.
void write_all(H5Sink& sink) {
  sink.attribute("/", "format", std::string("x"));
  sink.text("/protocol/toml", "text");
  RowStream stream{rows, {{"/pressure/time_s", "s"}, {"/pressure/cavity_kPa", "kPa"}}, {}};
  stream.each = [](const RowStream::Take& take) {
    for (size_t row = 0; row < rows; row += 100) {
      std::vector<double> values;
      for (size_t i = 0; i < 100; ++i)
        values.push_back(std::sin(static_cast<double>((row + i) * (row + i))));
      for (const size_t column : {size_t{0}, size_t{1}})
        take(column, values);
    }
  };
  sink.rows(stream);
  sink.table("/events", {{"time_s", std::vector<double>{1, 2}}, {"text", std::vector<std::string>{"a", "b"}}},
             "text");
  sink.finish();
}

int open_objects() {
  return static_cast<int>(H5Fget_obj_count(static_cast<hid_t>(H5F_OBJ_ALL), H5F_OBJ_ALL));
}

TEST(H5Disk, WhatIsWrittenInBlocksIsReadBack) {
  const Scratch scratch("h5disk");
  const std::filesystem::path path = scratch / "whole.h5";
  {
    const Descriptor file(::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600));
    H5Disk disk(file.get());
    H5Sink sink("whole.h5", disk);
    write_all(sink);
    EXPECT_EQ(disk.error(), 0);
  }
  const runfile::H5Source source(path);
  const std::vector<double> values = source.numbers("/pressure/cavity_kPa");
  ASSERT_EQ(values.size(), rows);
  for (const size_t row : {size_t{0}, size_t{4095}, size_t{4096}, rows - 1})
    EXPECT_DOUBLE_EQ(values[row], std::sin(static_cast<double>(row * row)));
  EXPECT_EQ(source.text("/protocol/toml"), "text");
}

TEST(H5Disk, OneThatFillsAtAnyWriteIsToldAndTheLibraryForgetsTheFile) {
  const auto write_with_room = [](size_t room, size_t& wanted) {
    const Descriptor file(::memfd_create("full", MFD_CLOEXEC));
    H5Disk disk(file.get(), [&](int descriptor, const void* bytes, size_t size, off_t at) -> ssize_t {
      wanted = std::max(wanted, static_cast<size_t>(at) + size);
      if (static_cast<size_t>(at) + size <= room) return ::pwrite(descriptor, bytes, size, at);
      errno = ENOSPC;
      return -1;
    });
    H5Sink sink("full.h5", disk);
    write_all(sink);
  };
  size_t whole = 0;
  write_with_room(SIZE_MAX, whole);
  ASSERT_GT(whole, 200'000U);
  for (size_t room = 0; room < whole; room += 5'003) {
    size_t wanted = 0;
    EXPECT_THAT(message_of<HardwareError>([&] { write_with_room(room, wanted); }),
                testing::AllOf(testing::HasSubstr("full.h5"), testing::HasSubstr("No space left on device")))
        << room;
    EXPECT_EQ(open_objects(), 0) << "room for " << room << " bytes";
  }
}

}  // namespace
}  // namespace diastole
