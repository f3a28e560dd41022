#include "protocol/runfile/flow_writer.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <string_view>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/layout.hpp"
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

bool write_numbers(hid_t group, std::string_view name, const std::vector<double>& values) {
  const hsize_t size = values.size();
  const SpaceHandle space(H5Screate_simple(1, &size, nullptr));
  const DatasetHandle dataset(H5Dcreate2(group, std::string(name).c_str(), H5T_IEEE_F64LE, space.get(),
                                         H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
  if (!dataset.valid() ||
      H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) < 0)
    return false;
  const std::string unit(unit_of(name));
  const TypeHandle type(H5Tcopy(H5T_C_S1));
  const SpaceHandle scalar(H5Screate(H5S_SCALAR));
  if (H5Tset_size(type.get(), unit.size()) < 0) return false;
  const AttributeHandle attribute(
      H5Acreate2(dataset.get(), "units", type.get(), scalar.get(), H5P_DEFAULT, H5P_DEFAULT));
  return attribute.valid() && H5Awrite(attribute.get(), type.get(), unit.data()) >= 0;
}

bool write_group(const fs::path& file, const std::string& name, bool is_there, const FlowVolume& volume) {
  const FileHandle opened(H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT));
  if (!opened.valid()) return false;
  if (is_there && H5Ldelete(opened.get(), name.c_str(), H5P_DEFAULT) < 0) return false;
  const PropertyHandle with_parents(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(with_parents.get(), 1);
  const GroupHandle group(
      H5Gcreate2(opened.get(), name.c_str(), with_parents.get(), H5P_DEFAULT, H5P_DEFAULT));
  return group.valid() && write_numbers(group.get(), "phase_s", volume.phase_s) &&
         write_numbers(group.get(), "cavity_mL", volume.cavity_mL) &&
         write_numbers(group.get(), "sigma_mL", volume.sigma_mL) &&
         H5Fflush(opened.get(), H5F_SCOPE_GLOBAL) >= 0;
}

bool is_on_disk(const fs::path& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool synced = ::fsync(descriptor) == 0;
  ::close(descriptor);
  return synced;
}

}  // namespace

void store_flow(const fs::path& path, size_t segment, const FlowVolume& volume, bool replace) {
  RecordedRun run = read_run(path);
  const std::string name = fmt::format("{}/{}", flow_group, segment);
  if (segment >= run.segments.size())
    throw InputError({run.file, "group " + name,
                      fmt::format("there is no segment {}; the run has {}", segment, run.segments.size()),
                      "Segments count from 0."});
  const bool is_there = run.flow.contains(segment);
  if (is_there && !replace)
    throw InputError(
        {run.file, "group " + name, "holds a measured volume already", "Give --force to replace it."});
  run.flow[segment] = volume;
  check(run);
  const Beside beside{path.string() + ".flow-partial"};
  std::error_code error;
  fs::copy_file(path, beside.path, fs::copy_options::overwrite_existing, error);
  if (!error && write_group(beside.path, name, is_there, volume) && is_on_disk(beside.path)) {
    (void)read_run(beside.path);
    fs::rename(beside.path, path, error);
    if (!error) return;
  }
  throw InputError({run.file, "group " + name,
                    "cannot be written" + (error ? ": " + error.message() : std::string()),
                    "Check that file and folder may be changed, and the space on their disk."});
}

}  // namespace diastole::runfile
