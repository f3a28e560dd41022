#pragma once
// Typed writing into a new HDF5 file; the counterpart of protocol/runfile/h5_source.hpp.
//
// What is written goes to the disk as it comes (h5_disk.hpp); nothing that grows with the run is held in memory.

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "host/runfile/h5_disk.hpp"
#include "host/runfile/row_stream.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {

/// A column of a compound table: numbers, whole numbers or texts, all columns of a table equally long.
struct TableColumn {
  std::string name;
  std::variant<std::vector<double>, std::vector<int64_t>, std::vector<std::string>> values;
};

/// Groups on the way to an object are made as needed; every dataset gets its `units`.
/// Errors: every member throws HardwareError when the disk refuses, or when the library does not take it (no memory
/// left).
class H5Sink {
 public:
  /// `name` is the file's in messages; `disk` outlives this.
  H5Sink(std::string name, H5Disk& disk) : name_(std::move(name)), disk_(disk) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
    file_ = runfile::FileHandle(H5Fcreate(name_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, disk_.access().get()));
    must(file_.valid(), "the file");
  }

  void attribute(const std::string& object, const std::string& name, const runfile::Attribute& value) {
    const runfile::ObjectHandle handle(H5Oopen(file_.get(), object.c_str(), H5P_DEFAULT));
    must(handle.valid(), object);
    attribute_on(handle.get(), name, value);
  }
  void group(const std::string& path) {
    must(runfile::GroupHandle(H5Gcreate2(file_.get(), path.c_str(), H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT))
             .valid(),
         path);
  }
  void numbers(const std::string& path, std::span<const double> values, const std::string& units) {
    const hsize_t rows = values.size();
    const runfile::SpaceHandle space(H5Screate_simple(1, &rows, nullptr));
    const runfile::DatasetHandle dataset = create(path, H5T_IEEE_F64LE, space, rows >= chunk_rows, units);
    must(rows == 0 ||
             H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()) >= 0,
         "dataset " + path);
  }
  void scalar(const std::string& path, double value, const std::string& units) {
    const runfile::SpaceHandle space(H5Screate(H5S_SCALAR));
    const runfile::DatasetHandle dataset = create(path, H5T_IEEE_F64LE, space, false, units);
    must(H5Dwrite(dataset.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0,
         "dataset " + path);
  }
  void text(const std::string& path, const std::string& value) {
    const runfile::SpaceHandle space(H5Screate(H5S_SCALAR));
    const runfile::TypeHandle type = text_type(H5T_VARIABLE);
    const runfile::DatasetHandle dataset = create(path, type.get(), space, false, runfile::text_unit);
    const char* text = value.c_str();
    must(H5Dwrite(dataset.get(), type.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, &text) >= 0, "dataset " + path);
  }
  void table(const std::string& path, const std::vector<TableColumn>& columns, const std::string& units) {
    std::vector<runfile::TypeHandle> types;
    std::vector<size_t> offsets;
    size_t row_bytes = 0;
    for (const TableColumn& column : columns) {
      types.push_back(column_type(column));
      offsets.push_back(row_bytes);
      row_bytes += H5Tget_size(types.back().get());
    }
    const runfile::TypeHandle row(H5Tcreate(H5T_COMPOUND, row_bytes));
    for (size_t i = 0; i < columns.size(); ++i)
      H5Tinsert(row.get(), columns[i].name.c_str(), offsets[i], types[i].get());
    const hsize_t rows = rows_of(columns.front());
    std::vector<char> bytes(rows * row_bytes);
    for (size_t r = 0; r < rows; ++r) {
      for (size_t i = 0; i < columns.size(); ++i)
        put_cell(columns[i], r, &bytes[r * row_bytes + offsets[i]]);
    }
    const runfile::SpaceHandle space(H5Screate_simple(1, &rows, nullptr));
    const runfile::DatasetHandle dataset = create(path, row.get(), space, false, units);
    must(rows == 0 || H5Dwrite(dataset.get(), row.get(), H5S_ALL, H5S_ALL, H5P_DEFAULT, bytes.data()) >= 0,
         "dataset " + path);
  }
  /// All columns of a stream, block by block.
  void rows(const RowStream& stream) {
    const hsize_t rows = stream.rows;
    const runfile::SpaceHandle space(H5Screate_simple(1, &rows, nullptr));
    std::vector<runfile::DatasetHandle> datasets;
    std::vector<hsize_t> written(stream.columns.size(), 0);
    for (const RowColumn& column : stream.columns) {
      datasets.push_back(create(column.path, H5T_IEEE_F64LE, space, rows >= chunk_rows, column.unit));
      for (const auto& [note, value] : column.notes)
        attribute_on(datasets.back().get(), note, value);
    }
    stream.each([&](size_t column, std::span<const double> values) {
      const hsize_t count = values.size();
      if (count == 0) return;
      const runfile::SpaceHandle memory(H5Screate_simple(1, &count, nullptr));
      must(
          H5Sselect_hyperslab(space.get(), H5S_SELECT_SET, &written[column], nullptr, &count, nullptr) >= 0 &&
              H5Dwrite(datasets[column].get(), H5T_NATIVE_DOUBLE, memory.get(), space.get(), H5P_DEFAULT,
                       values.data()) >= 0,
          "dataset " + stream.columns[column].path);
      written[column] += count;
    });
    for (size_t i = 0; i < written.size(); ++i)
      must(written[i] == rows, "dataset " + stream.columns[i].path);
  }
  /// Closes the file: it is whole, though not yet brought to the disk. The last call.
  void finish() {
    must(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0, "the file");
    file_ = runfile::FileHandle();
    must(true, "the file");
  }

 private:
  static constexpr hsize_t chunk_rows = 4096;

  static runfile::TypeHandle text_type(size_t size) {
    runfile::TypeHandle type(H5Tcopy(H5T_C_S1));
    H5Tset_size(type.get(), size);
    H5Tset_cset(type.get(), H5T_CSET_UTF8);
    return type;
  }

  static size_t rows_of(const TableColumn& column) {
    return std::visit([](const auto& values) { return values.size(); }, column.values);
  }

  /// Texts of a table have a fixed length, so that MATLAB reads them too: the longest one's, and a final NUL.
  static runfile::TypeHandle column_type(const TableColumn& column) {
    if (std::holds_alternative<std::vector<double>>(column.values)) {
      return runfile::TypeHandle(H5Tcopy(H5T_NATIVE_DOUBLE));
    }
    if (std::holds_alternative<std::vector<int64_t>>(column.values)) {
      return runfile::TypeHandle(H5Tcopy(H5T_NATIVE_INT64));
    }
    size_t longest = 0;
    for (const std::string& text : std::get<std::vector<std::string>>(column.values))
      longest = std::max(longest, text.size());
    return text_type(longest + 1);
  }

  static void put_cell(const TableColumn& column, size_t row, char* target) {
    if (const auto* numbers = std::get_if<std::vector<double>>(&column.values)) {
      std::memcpy(target, &(*numbers)[row], sizeof(double));
    } else if (const auto* integers = std::get_if<std::vector<int64_t>>(&column.values)) {
      std::memcpy(target, &(*integers)[row], sizeof(int64_t));
    } else {
      const std::string& text = std::get<std::vector<std::string>>(column.values)[row];
      std::memcpy(target, text.c_str(), text.size() + 1);
    }
  }

  runfile::DatasetHandle create(const std::string& path, hid_t type, const runfile::SpaceHandle& space,
                                bool compressed, const std::string& units) {
    runfile::DatasetHandle dataset =
        runfile::create_dataset(file_.get(), path, type, space, compressed ? chunk_rows : 0);
    must(dataset.valid(), "dataset " + path);
    attribute_on(dataset.get(), "units", units);
    return dataset;
  }
  void attribute_on(hid_t object, const std::string& name, const runfile::Attribute& value) {
    const runfile::SpaceHandle space(H5Screate(H5S_SCALAR));
    const auto put = [&](hid_t type, const void* bytes) {
      const runfile::AttributeHandle attribute(
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
  void must(bool done, const std::string& object) const {
    if (disk_.error() != 0) {
      throw HardwareError(name_, fmt::format("cannot be written: {}", std::strerror(disk_.error())),
                          "Check the space on the disk and that you may write there.");
    }
    if (!done) throw HardwareError(name_, object + " cannot be written", "Free some memory.");
  }

  std::string name_;
  H5Disk& disk_;
  runfile::FileHandle file_;
};

}  // namespace diastole
