#include "protocol/runfile/flow_writer.hpp"

#include <fmt/format.h>

#include <string_view>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/amended_file.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/reader.hpp"

namespace diastole::runfile {
namespace {

namespace fs = std::filesystem;

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

bool write_group(hid_t file, const std::string& name, bool is_there, const FlowVolume& volume) {
  if (is_there && H5Ldelete(file, name.c_str(), H5P_DEFAULT) < 0) return false;
  const PropertyHandle with_parents(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(with_parents.get(), 1);
  const GroupHandle group(H5Gcreate2(file, name.c_str(), with_parents.get(), H5P_DEFAULT, H5P_DEFAULT));
  return group.valid() && write_numbers(group.get(), "phase_s", volume.phase_s) &&
         write_numbers(group.get(), "cavity_mL", volume.cavity_mL) &&
         write_numbers(group.get(), "sigma_mL", volume.sigma_mL);
}

}  // namespace

void store_flow(const fs::path& path, size_t segment, const FlowVolume& volume, bool replace) {
  auto [run, rows] = open_run(path);
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
  check(run, rows);
  amend_run(path, "group " + name, [&](hid_t file) { return write_group(file, name, is_there, volume); });
}

}  // namespace diastole::runfile
