#include "host/runfile/h5_disk.hpp"

#include <algorithm>
#include <cerrno>
#include <memory>

namespace diastole {
namespace {

/// A file as the library's driver interface sees it; the library's own part comes first.
struct OpenFile {
  H5FD_t own{};
  H5Disk* disk = nullptr;
  haddr_t allocated = 0;  ///< the library's "end of address space"
  haddr_t end = 0;
};

OpenFile& of(H5FD_t* file) { return *reinterpret_cast<OpenFile*>(file); }
const OpenFile& of(const H5FD_t* file) { return *reinterpret_cast<const OpenFile*>(file); }

H5FD_t* open(const char*, unsigned, hid_t access, haddr_t) {
  auto file = std::make_unique<OpenFile>();
  file->disk = *static_cast<H5Disk* const*>(H5Pget_driver_info(access));
  return &file.release()->own;
}

herr_t close(H5FD_t* file) {
  delete &of(file);
  return 0;
}

herr_t query(const H5FD_t*, unsigned long* flags) {
  if (flags != nullptr) {
    *flags = H5FD_FEAT_AGGREGATE_METADATA | H5FD_FEAT_ACCUMULATE_METADATA | H5FD_FEAT_DATA_SIEVE |
             H5FD_FEAT_AGGREGATE_SMALLDATA;
  }
  return 0;
}

haddr_t get_eoa(const H5FD_t* file, H5FD_mem_t) { return of(file).allocated; }

herr_t set_eoa(H5FD_t* file, H5FD_mem_t, haddr_t address) {
  of(file).allocated = address;
  return 0;
}

haddr_t get_eof(const H5FD_t* file, H5FD_mem_t) { return of(file).end; }

herr_t read(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, size_t size, void* buffer) {
  of(file).disk->read({static_cast<std::byte*>(buffer), size}, at);
  return 0;
}

herr_t write(H5FD_t* file, H5FD_mem_t, hid_t, haddr_t at, size_t size, const void* buffer) {
  of(file).disk->write({static_cast<const std::byte*>(buffer), size}, at);
  of(file).end = std::max(of(file).end, at + size);
  return 0;
}

herr_t truncate(H5FD_t* file, hid_t, hbool_t) {
  if (of(file).end != of(file).allocated) of(file).disk->resize(of(file).allocated);
  of(file).end = of(file).allocated;
  return 0;
}

hid_t driver() {
  static const hid_t registered = [] {
    H5FD_class_t driver{};
    driver.name = "diastole-disk";
    driver.maxaddr = (haddr_t{1} << 62U);
    driver.fc_degree = H5F_CLOSE_WEAK;
    driver.fapl_size = sizeof(H5Disk*);
    driver.open = open;
    driver.close = close;
    driver.query = query;
    driver.get_eoa = get_eoa;
    driver.set_eoa = set_eoa;
    driver.get_eof = get_eof;
    driver.read = read;
    driver.write = write;
    driver.truncate = truncate;
    return H5FDregister(&driver);
  }();
  return registered;
}

}  // namespace

H5Disk::H5Disk(int descriptor, Write write) : descriptor_(descriptor), write_(std::move(write)) {}

runfile::PropertyHandle H5Disk::access() {
  runfile::PropertyHandle access(H5Pcreate(H5P_FILE_ACCESS));
  H5Disk* const self = this;
  H5Pset_driver(access.get(), driver(), &self);
  // Of each dataset only the chunk that is being filled is needed.
  constexpr size_t cached_chunks = 31, cached_bytes = 128U << 10;
  H5Pset_cache(access.get(), 0, cached_chunks, cached_bytes, 1.0);
  return access;
}

void H5Disk::write(std::span<const std::byte> bytes, haddr_t at) {
  while (error_ == 0 && !bytes.empty()) {
    const ssize_t written = write_(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) {
      error_ = written < 0 ? errno : ENOSPC;
      break;
    }
    bytes = bytes.subspan(static_cast<size_t>(written));
    at += static_cast<haddr_t>(written);
  }
  if (!bytes.empty()) refused_.push_back({at, {bytes.begin(), bytes.end()}});
}

void H5Disk::read(std::span<std::byte> bytes, haddr_t at) const {
  std::ranges::fill(bytes, std::byte{0});
  for (size_t done = 0; done < bytes.size();) {
    const ssize_t got =
        ::pread(descriptor_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(at + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<size_t>(got);
  }
  for (const Refused& piece : refused_) {
    const haddr_t first = std::max(at, piece.at);
    const haddr_t last = std::min(at + bytes.size(), piece.at + piece.bytes.size());
    if (first >= last) continue;
    std::copy_n(piece.bytes.begin() + static_cast<std::ptrdiff_t>(first - piece.at), last - first,
                bytes.begin() + static_cast<std::ptrdiff_t>(first - at));
  }
}

void H5Disk::resize(haddr_t size) {
  if (error_ == 0 && ::ftruncate(descriptor_, static_cast<off_t>(size)) != 0) error_ = errno;
}

}  // namespace diastole
