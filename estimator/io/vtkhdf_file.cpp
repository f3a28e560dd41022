#include "estimator/io/vtkhdf_file.hpp"

#include <cstdint>
#include <numeric>

#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_handle.hpp"

namespace diastole {
namespace {

using runfile::AttributeHandle;
using runfile::DatasetHandle;
using runfile::FileHandle;
using runfile::ObjectHandle;
using runfile::SpaceHandle;
using runfile::TypeHandle;

constexpr size_t points_a_cell = 64;
constexpr uint8_t bezier_hexahedron = 79;
constexpr hsize_t compressed_from = 4096;  // rows; shorter datasets are stored as they are

/// Typed writing below /VTKHDF. Every failure is one of the disk, reported of the file that is asked for, not of the
/// temporary one.
class Sink {
 public:
  Sink(const std::filesystem::path& temporary, const std::filesystem::path& asked_for)
      : name_(asked_for.string()) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    file_ = FileHandle(H5Fcreate(temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT));
    must(file_.valid());
  }

  void rows(const std::string& path, hid_t stored, hid_t given, const void* values,
            const std::vector<hsize_t>& shape) {
    const SpaceHandle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr));
    const DatasetHandle dataset = runfile::create_dataset(file_.get(), path, stored, space,
                                                          shape[0] >= compressed_from ? compressed_from : 0);
    must(dataset.valid() && H5Dwrite(dataset.get(), given, H5S_ALL, H5S_ALL, H5P_DEFAULT, values) >= 0);
  }
  void whole_numbers(const std::string& path, const std::vector<int64_t>& values) {
    rows(path, H5T_STD_I64LE, H5T_NATIVE_INT64, values.data(), {values.size()});
  }
  void numbers(const std::string& path, const std::vector<double>& values, size_t components) {
    std::vector<hsize_t> shape{values.size() / components};
    if (components > 1) shape.push_back(components);
    rows(path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, values.data(), shape);
  }

  void whole_attribute(const std::string& object, const char* name, const std::vector<int64_t>& values) {
    const hsize_t count = values.size();
    const SpaceHandle space(count == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &count, nullptr));
    attribute(object, name, H5T_STD_I64LE, H5T_NATIVE_INT64, space, values.data());
  }
  /// Of fixed length in ASCII: other forms are not read.
  void text_attribute(const std::string& object, const char* name, const std::string& value) {
    const TypeHandle type(H5Tcopy(H5T_C_S1));
    H5Tset_size(type.get(), value.size());
    H5Tset_strpad(type.get(), H5T_STR_NULLPAD);
    attribute(object, name, type.get(), type.get(), SpaceHandle(H5Screate(H5S_SCALAR)), value.data());
  }
  void close() {
    must(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0);
    file_ = FileHandle();
  }

 private:
  void attribute(const std::string& object, const char* name, hid_t stored, hid_t given,
                 const SpaceHandle& space, const void* value) {
    const ObjectHandle holder(H5Oopen(file_.get(), object.c_str(), H5P_DEFAULT));
    must(holder.valid());
    const AttributeHandle made(H5Acreate2(holder.get(), name, stored, space.get(), H5P_DEFAULT, H5P_DEFAULT));
    must(made.valid() && H5Awrite(made.get(), given, value) >= 0);
  }
  void must(bool done) const {
    if (done) return;
    throw InputError({name_, "", "the file cannot be written",
                      "Check the folder, that you may write there, and the space on the disk."});
  }

  std::string name_;
  FileHandle file_;
};

void write_cells(Sink& sink, size_t cells) {
  const auto count = static_cast<int64_t>(cells);
  constexpr auto each = static_cast<int64_t>(points_a_cell);
  std::vector<int64_t> connectivity(cells * points_a_cell);
  std::iota(connectivity.begin(), connectivity.end(), int64_t{0});
  std::vector<int64_t> offsets;
  for (int64_t cell = 0; cell <= count; ++cell)
    offsets.push_back(cell * each);
  const std::vector<uint8_t> types(cells, bezier_hexahedron);
  sink.whole_numbers("/VTKHDF/Connectivity", connectivity);
  sink.whole_numbers("/VTKHDF/Offsets", offsets);
  sink.rows("/VTKHDF/Types", H5T_STD_U8LE, H5T_NATIVE_UINT8, types.data(), {types.size()});
  sink.numbers("/VTKHDF/CellData/HigherOrderDegrees", std::vector<double>(3 * cells, 3.0), 3);
  sink.text_attribute("/VTKHDF/CellData/HigherOrderDegrees", "Attribute", "HigherOrderDegrees");
}

/// One dataset for all steps: their rows one after the other.
void write_stepped(Sink& sink, const BezierGrid& grid, std::vector<GridArray> GridStep::*arrays,
                   const std::string& group) {
  const std::vector<GridArray>& first = grid.steps.front().*arrays;
  for (size_t i = 0; i < first.size(); ++i) {
    std::vector<double> values;
    for (const GridStep& step : grid.steps) {
      const std::vector<double>& of_step = (step.*arrays)[i].values;
      values.insert(values.end(), of_step.begin(), of_step.end());
    }
    sink.numbers("/VTKHDF/" + group + "/" + first[i].name, values, first[i].components);
    if (grid.steps.size() == 1) continue;
    const size_t rows = first[i].values.size() / first[i].components;
    std::vector<int64_t> offsets;
    for (size_t step = 0; step < grid.steps.size(); ++step)
      offsets.push_back(static_cast<int64_t>(step * rows));
    sink.whole_numbers("/VTKHDF/Steps/" + group + "Offsets/" + first[i].name, offsets);
  }
}

/// The same part, points and cells in every step.
void write_steps(Sink& sink, const BezierGrid& grid) {
  const size_t count = grid.steps.size();
  const std::vector<int64_t> zeros(count, 0);
  std::vector<double> times_s;
  for (const GridStep& step : grid.steps)
    times_s.push_back(step.time_s);
  sink.numbers("/VTKHDF/Steps/Values", times_s, 1);
  sink.whole_attribute("/VTKHDF/Steps", "NSteps", {static_cast<int64_t>(count)});
  sink.whole_numbers("/VTKHDF/Steps/NumberOfParts", std::vector<int64_t>(count, 1));
  sink.whole_numbers("/VTKHDF/Steps/PartOffsets", zeros);
  sink.whole_numbers("/VTKHDF/Steps/PointOffsets", zeros);
  for (const char* topology : {"CellOffsets", "ConnectivityIdOffsets"})
    sink.rows(std::string("/VTKHDF/Steps/") + topology, H5T_STD_I64LE, H5T_NATIVE_INT64, zeros.data(),
              {count, 1});
  for (const GridArray& array : grid.cell_data)
    sink.whole_numbers("/VTKHDF/Steps/CellDataOffsets/" + array.name, zeros);
  sink.whole_numbers("/VTKHDF/Steps/CellDataOffsets/HigherOrderDegrees", zeros);
}

void write_all(const std::filesystem::path& temporary, const std::filesystem::path& path,
               const BezierGrid& grid) {
  const size_t points = grid.points_mm.size() / 3;
  const bool temporal = grid.steps.size() > 1;
  Sink sink(temporary, path);
  sink.numbers("/VTKHDF/Points", grid.points_mm, 3);
  sink.whole_attribute("/VTKHDF", "Version", {temporal ? 2 : 1, 0});
  sink.text_attribute("/VTKHDF", "Type", "UnstructuredGrid");
  sink.whole_numbers("/VTKHDF/NumberOfPoints", {static_cast<int64_t>(points)});
  sink.whole_numbers("/VTKHDF/NumberOfCells", {static_cast<int64_t>(points / points_a_cell)});
  sink.whole_numbers("/VTKHDF/NumberOfConnectivityIds", {static_cast<int64_t>(points)});
  write_cells(sink, points / points_a_cell);
  for (const GridArray& array : grid.cell_data)
    sink.numbers("/VTKHDF/CellData/" + array.name, array.values, array.components);
  if (temporal) write_steps(sink, grid);
  write_stepped(sink, grid, &GridStep::point_data, "PointData");
  write_stepped(sink, grid, &GridStep::field_data, "FieldData");
  sink.close();
}

}  // namespace

void write_vtkhdf(const std::filesystem::path& path, const BezierGrid& grid) {
  write_whole_file(path, [&](const std::filesystem::path& unfinished) { write_all(unfinished, path, grid); });
}

}  // namespace diastole
