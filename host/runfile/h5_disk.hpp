#pragma once
// The disk under an HDF5 file that is being written.
//
// The HDF5 library neither closes nor forgets a file whose disk has refused a write, and complains of it when the program
// ends. So it is not informed: from the first refusal on, what it writes stays in memory, from where it reads it back, until
// it has closed the file. The refusal is reported to whoever asks for it, who then writes no more; what the library still
// has to say is some megabytes of its own bookkeeping.

#include <hdf5.h>
#include <unistd.h>

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "protocol/runfile/h5_handle.hpp"

namespace diastole {

class H5Disk {
 public:
  /// As pwrite(2).
  using Write = std::function<ssize_t(int descriptor, const void* bytes, size_t size, off_t at)>;

  /// `descriptor`: an empty file, open for reading and writing, which outlives this. This outlives the HDF5 file.
  explicit H5Disk(int descriptor, Write write = ::pwrite);
  H5Disk(const H5Disk&) = delete;
  H5Disk& operator=(const H5Disk&) = delete;

  /// For H5Fcreate, whose file name then names nothing.
  [[nodiscard]] runfile::PropertyHandle access();
  /// errno of the first write that the disk refused; 0: none.
  [[nodiscard]] int error() const { return error_; }

  void write(std::span<const std::byte> bytes, haddr_t at);
  /// Zeros where nothing was written.
  void read(std::span<std::byte> bytes, haddr_t at) const;
  void resize(haddr_t size);

 private:
  struct Refused {
    haddr_t at = 0;
    std::vector<std::byte> bytes;
  };

  int descriptor_;
  Write write_;
  int error_ = 0;
  std::vector<Refused> refused_;  // the newest last
};

}  // namespace diastole
