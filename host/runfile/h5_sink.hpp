#pragma once
// Typed writing into a new HDF5 file; the counterpart of protocol/runfile/h5_source.hpp.
//
// What is written goes to the disk as it comes (h5_disk.hpp); nothing that grows with the run is held in memory.

#include <cstddef>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "host/runfile/h5_disk.hpp"
#include "host/runfile/row_stream.hpp"
#include "protocol/runfile/h5_handle.hpp"
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
  H5Sink(std::string name, H5Disk& disk);

  void attribute(const std::string& object, const std::string& name, const runfile::Attribute& value);
  void group(const std::string& path);
  void numbers(const std::string& path, std::span<const double> values, const std::string& units);
  void scalar(const std::string& path, double value, const std::string& units);
  void text(const std::string& path, const std::string& value);
  void table(const std::string& path, const std::vector<TableColumn>& columns, const std::string& units);
  /// All columns of a stream, block by block.
  void rows(const RowStream& stream);
  /// Closes the file: it is whole, though not yet brought to the disk. The last call.
  void finish();

 private:
  runfile::DatasetHandle create(const std::string& path, hid_t type, const runfile::SpaceHandle& space,
                                bool compressed, const std::string& units);
  void attribute_on(hid_t object, const std::string& name, const runfile::Attribute& value);
  void must(bool done, const std::string& object) const;

  std::string name_;
  H5Disk& disk_;
  runfile::FileHandle file_;
};

}  // namespace diastole
