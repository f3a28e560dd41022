#include "protocol/runfile/amended_file.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/h5_source.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::runfile {
namespace {

namespace fs = std::filesystem;

/// Removed unless it has become the file itself.
struct Beside {
  fs::path path;
  ~Beside() {
    std::error_code ignored;
    fs::remove(path, ignored);
  }
};

/// The lock of a folder, given back at the end; without one (a file system that has none) nobody waits.
class FolderLock {
 public:
  explicit FolderLock(const fs::path& folder)
      : descriptor_(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {
    if (descriptor_ >= 0) (void)::flock(descriptor_, LOCK_EX);
  }
  ~FolderLock() {
    if (descriptor_ >= 0) ::close(descriptor_);
  }
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int descriptor_;
};

bool change_file(const fs::path& file, const std::function<bool(hid_t)>& change) {
  const FileHandle opened(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
  return opened.valid() && change(opened.get()) && H5Fflush(opened.get(), H5F_SCOPE_GLOBAL) >= 0;
}

bool is_on_disk(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool synced = ::fsync(descriptor) == 0;
  ::close(descriptor);
  return synced;
}

}  // namespace

void amend_run(const fs::path& named, const std::string& place, const std::function<bool(hid_t)>& change) {
  (void)H5Source(named);  // none of its links leads to another file, which would be changed then
  const fs::path path = fs::canonical(named);  // a link to a run stays one
  const FolderLock lock(path.has_parent_path() ? path.parent_path() : ".");
  const Beside beside{path.string() + ".amended-partial"};
  std::error_code error;
  fs::copy_file(path, beside.path, fs::copy_options::overwrite_existing, error);
  if (::access(path.c_str(), W_OK) != 0) error.assign(errno, std::generic_category());
  if (!error && change_file(beside.path, change) && is_on_disk(beside.path)) {
    (void)open_run(beside.path);
    fs::rename(beside.path, path, error);
    if (!error) return;
  }
  throw InputError({named.string(), place,
                    "cannot be written" + (error ? ": " + error.message() : std::string()),
                    "Check that file and folder may be changed, and the space on their disk."});
}

}  // namespace diastole::runfile
