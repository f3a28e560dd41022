#include "host/runfile/h5_sink.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"

namespace diastole {
namespace {

using runfile::AttributeHandle;
using runfile::DatasetHandle;
using runfile::FileHandle;
using runfile::GroupHandle;
using runfile::ObjectHandle;
using runfile::PropertyHandle;
using runfile::SpaceHandle;
using runfile::TypeHandle;

constexpr hsize_t chunk_rows = 4096;
constexpr unsigned deflate_level = 4;

TypeHandle text_type(size_t size) {
  TypeHandle type(H5Tcopy(H5T_C_S1));
  H5Tset_size(type.get(), size);
  H5Tset_cset(type.get(), H5T_CSET_UTF8);
  return type;
}

size_t rows_of(const TableColumn& column) {
  return std::visit([](const auto& values) { return values.size(); }, column.values);
}

/// Texts of a table have a fixed length, so that MATLAB reads them too: the longest one's, and a final NUL.
TypeHandle column_type(const TableColumn& column) {
  if (std::holds_alternative<std::vector<double>>(column.values)) {
    return TypeHandle(H5Tcopy(H5T_NATIVE_DOUBLE));
  }
  if (std::holds_alternative<std::vector<int64_t>>(column.values)) {
    return TypeHandle(H5Tcopy(H5T_NATIVE_INT64));
  }
  size_t longest = 0;
  for (const std::string& text : std::get<std::vector<std::string>>(column.values))
    longest = std::max(longest, text.size());
  return text_type(longest + 1);
}

void put_cell(const TableColumn& column, size_t row, char* target) {
  if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
    std::memcpy(target, &(*numbers)[row], sizeof(double));
  } else if (const auto* integers = std::get_if<std::vector<int64_t>>(&column.values)) {
    std::memcpy(target, &(*integers)[row], sizeof(int64_t));
  } else {
    const std::string& text = std::get<std::vector<std::string>>(column.values)[row];
    std::memcpy(target, text.c_str(), text.size() + 1);
  }
}

}  // namespace

H5Sink::H5Sink(std::string name, H5Disk& disk) : name_(std::move(name)), disk_(disk) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  file_ = FileHandle(H5Fcreate(name_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, disk_.access().get()));
  must(file_.valid(), "the file");
}

void H5Sink::must(bool done, const std::string& object) const {
  if (disk_.error() != 0) {
    throw HardwareError(name_, fmt::format("cannot be written: {}", std::strerror(disk_.error())),
                        "Check the space on the disk and that you may write there.");
  }
  if (!done) throw HardwareError(name_, object + " cannot be written", "Free some memory.");
}

void H5Sink::attribute(const std::string& object, const std::string& name, const runfile::Attribute& value) {
  const ObjectHandle handle(H5Oopen(file_.get(), object.c_str(), H5P_DEFAULT));
  must(handle.valid(), object);
  attribute_on(handle.get(), name, value);
}

void H5Sink::attribute_on(hid_t object, const std::string& name, const runfile::Attribute& value) {
  const SpaceHandle space(H5Screate(H5S_SCALAR));
  const auto put = [&](hid_t type, const void* bytes) {
    const AttributeHandle attribute(
        H5Acreate2(object, name.c_str(), type, space.get(), H5P_DEFAULT, H5P_DEFAULT));
    must(attribute.valid() && H5Awrite(attribute.get(), type, bytes) >= 0, "attribute " + name);
  };
  if (const auto* number = std::get_if<double>(&value)) {
    put(H5T_NATIVE_DOUBLE, number);
  } else if (const auto* integer = std::get_if<int64_t>(&value)) {
    put(H5T_NATIVE_INT64, integer);
  } else {
    const char* text = std::get<std::string>(value).c_str();
    put(text_type(H5T_VARIABLE).get(), &text);
  }
}

void H5Sink::group(const std::string& path) {
  must(GroupHandle(H5Gcreate2(file_.get(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT)).valid(),
       path);
}

DatasetHandle H5Sink::create(const std::string& path, hid_t type, const SpaceHandle& space, bool compressed,
                             const std::string& units) {
  const PropertyHandle links(H5Pcreate(H5P_LINK_CREATE));
  H5Pset_create_intermediate_group(links.get(), 1);
  const PropertyHandle layout(H5Pcreate(H5P_DATASET_CREATE));
  if (compressed) {
    const hsize_t rows = chunk_rows;
    H5Pset_chunk(layout.get(), 1, &rows);
    H5Pset_shuffle(layout.get());
    H5Pset_deflate(layout.get(), deflate_level);
  }
  DatasetHandle dataset(
      H5Dcreate2(file_.get(), path.c_str(), type, space.get(), links.get(), layout.get(), H5P_DEFAULT));
  must(dataset.valid(), "dataset " + path);
  attribute_on(dataset.get(), "units", units);
  return dataset;
}

void H5Sink::numbers(const std::string& path, std::span<const double> values, const std::string& units) {
  const hsize_t rows = values.size();
  const SpaceHandle space(H5Screate_simple(1, &rows, nullptr));
  const DatasetHandle dataset = create(path, H5T_IEEE_F64LE, space, rows >= chunk_rows, units);
  must(rows == 0 ||
           H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0,
       "dataset " + path);
}

void H5Sink::scalar(const std::string& path, double value, const std::string& units) {
  const SpaceHandle space(H5Screate(H5S_SCALAR));
  const DatasetHandle dataset = create(path, H5T_IEEE_F64LE, space, false, units);
  must(H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0,
       "dataset " + path);
}

void H5Sink::text(const std::string& path, const std::string& value) {
  const SpaceHandle space(H5Screate(H5S_SCALAR));
  const TypeHandle type = text_type(H5T_VARIABLE);
  const DatasetHandle dataset = create(path, type.get(), space, false, runfile::text_unit);
  const char* text = value.c_str();
  must(H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) >= 0, "dataset " + path);
}

void H5Sink::table(const std::string& path, const std::vector<TableColumn>& columns,
                   const std::string& units) {
  std::vector<TypeHandle> types;
  std::vector<size_t> offsets;
  size_t row_bytes = 0;
  for (const TableColumn& column : columns) {
    types.push_back(column_type(column));
    offsets.push_back(row_bytes);
    row_bytes += H5Tget_size(types.back().get());
  }
  const TypeHandle row(H5Tcreate(H5T_COMPOUND, row_bytes));
  for (size_t i = 0; i < columns.size(); ++i)
    H5Tinsert(row.get(), columns[i].name.c_str(), offsets[i], types[i].get());
  const hsize_t rows = rows_of(columns.front());
  std::vector<char> bytes(rows * row_bytes);
  for (size_t r = 0; r < rows; ++r) {
    for (size_t i = 0; i < columns.size(); ++i)
      put_cell(columns[i], r, &bytes[r * row_bytes + offsets[i]]);
  }
  const SpaceHandle space(H5Screate_simple(1, &rows, nullptr));
  const DatasetHandle dataset = create(path, row.get(), space, false, units);
  must(rows == 0 || H5Dwrite(dataset.get(), row.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) >= 0,
       "dataset " + path);
}

void H5Sink::rows(const RowStream& stream) {
  const hsize_t rows = stream.rows;
  const SpaceHandle space(H5Screate_simple(1, &rows, nullptr));
  std::vector<DatasetHandle> datasets;
  std::vector<hsize_t> written(stream.columns.size(), 0);
  for (const RowColumn& column : stream.columns) {
    datasets.push_back(create(column.path, H5T_IEEE_F64LE, space, rows >= chunk_rows, column.unit));
    for (const auto& [note, value] : column.notes)
      attribute_on(datasets.back().get(), note, value);
  }
  stream.each([&](size_t column, std::span<const double> values) {
    const hsize_t count = values.size();
    if (count == 0) return;
    const SpaceHandle memory(H5Screate_simple(1, &count, nullptr));
    must(H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &written[column], nullptr, &count, nullptr) >= 0 &&
             H5Dwrite(datasets[column].get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT,
                      values.data()) >= 0,
         "dataset " + stream.columns[column].path);
    written[column] += count;
  });
  for (size_t i = 0; i < written.size(); ++i)
    must(written[i] == rows, "dataset " + stream.columns[i].path);
}

void H5Sink::finish() {
  must(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0, "the file");
  file_ = FileHandle();
  must(true, "the file");
}

}  // namespace diastole
