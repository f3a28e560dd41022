#pragma once
// Typed writing into a new HDF5 file; the counterpart of protocol/runfile/h5_source.hpp.
//
// The file takes shape in memory: the HDF5 library neither closes nor forgets a file whose disk is full, and would
// complain of it when the program ends. Its bytes then reach the disk by the caller's own writing.

#include <cstddef>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole {

/// A column of a compound table: numbers, whole numbers or texts, all columns of a table equally long.
struct TableColumn {
  std::string name;
  std::variant<std::vector<double>, std::vector<int64_t>, std::vector<std::string>> values;
};

/// Groups on the way to an object are made as needed; every dataset gets its `units`.
/// Errors: every member throws HardwareError when the library does not take it (no memory left).
class H5Sink {
 public:
  /// `name` is the file's in messages.
  explicit H5Sink(std::string name);

  void attribute(const std::string& object, const std::string& name, const runfile::Attribute& value);
  void group(const std::string& path);
  void numbers(const std::string& path, std::span<const double> values, const std::string& units);
  void scalar(const std::string& path, double value, const std::string& units);
  void text(const std::string& path, const std::string& value);
  void table(const std::string& path, const std::vector<TableColumn>& columns, const std::string& units);
  /// The whole file as it shall stand on the disk.
  [[nodiscard]] std::vector<std::byte> image() const;

 private:
  runfile::DatasetHandle create(const std::string& path, hid_t type, const runfile::SpaceHandle& space,
                                bool compressed, const std::string& units);
  void attribute_on(hid_t object, const std::string& name, const runfile::Attribute& value);
  void must(bool done, const std::string& object) const;

  std::string name_;
  runfile::FileHandle file_;
};

}  // namespace diastole
