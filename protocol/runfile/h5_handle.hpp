#pragma once
// Ownership of HDF5 identifiers, for the reader here and the writer in host/runfile. HDF5's C interface
// returns a negative number for failure; a Handle that is not `valid()` holds one.

#include <hdf5.h>

#include <string>
#include <utility>
#include <vector>

namespace diastole::runfile {

/// Closes its identifier with the function that fits its kind (H5Fclose, H5Dclose, ...).
template <herr_t (*Close)(hid_t)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(hid_t id) : id_(id) {}
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, H5I_INVALID_HID)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() {
    if (valid()) Close(id_);
  }

  [[nodiscard]] bool valid() const { return id_ >= 0; }
  [[nodiscard]] hid_t get() const { return id_; }

 private:
  hid_t id_ = H5I_INVALID_HID;
};

using FileHandle = Handle<H5Fclose>;
using GroupHandle = Handle<H5Gclose>;
using ObjectHandle = Handle<H5Oclose>;
using DatasetHandle = Handle<H5Dclose>;
using AttributeHandle = Handle<H5Aclose>;
using SpaceHandle = Handle<H5Sclose>;
using TypeHandle = Handle<H5Tclose>;
using PropertyHandle = Handle<H5Pclose>;

/// A new dataset and the groups on the way to it; with `chunk_rows`, deflated in blocks of so many rows.
inline DatasetHandle create_dataset(hid_t file, const std::string& path, hid_t type, const SpaceHandle& space,
                                    hsize_t chunk_rows = 0) {
  const PropertyHandle links(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(links.get(), 1);
  const PropertyHandle layout(H5Pcreate(H5P_DATASET_CREATE));
  if (chunk_rows > 0) {
    const int rank = H5Sget_simple_extent_ndims(space.get());
    std::vector<hsize_t> chunk(static_cast<size_t>(rank));
    H5Sget_simple_extent_dims(space.get(), chunk.data(), nullptr);
    chunk[0] = chunk_rows;
    H5Pset_chunk(layout.get(), rank, chunk.data());
    H5Pset_shuffle(layout.get());
    H5Pset_deflate(layout.get(), 4);
  }
  return DatasetHandle(
      H5Dcreate2(file, path.c_str(), type, space.get(), links.get(), layout.get(), H5P_DEFAULT));
}

}  // namespace diastole::runfile
