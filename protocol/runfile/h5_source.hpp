#pragma once
// Typed reading from an open HDF5 file. Numbers of any width are converted by HDF5 itself; texts may be of
// fixed or variable length, in datasets, attributes and table columns alike.
//
// Errors: every member throws InputError naming the file and the object that is missing or of the wrong kind.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "protocol/runfile/h5_handle.hpp"
#include "protocol/runfile/run.hpp"

namespace diastole::runfile {

class H5Source {
 public:
  explicit H5Source(const std::filesystem::path& path);

  [[nodiscard]] bool has(const std::string& path) const;
  /// Names of the links directly below a group, sorted; empty if the group is absent.
  [[nodiscard]] std::vector<std::string> children(const std::string& group) const;

  /// A one-dimensional dataset of numbers.
  [[nodiscard]] std::vector<double> numbers(const std::string& path) const;
  /// A dataset that holds one number, or one text.
  [[nodiscard]] double scalar(const std::string& path) const;
  [[nodiscard]] std::string text(const std::string& path) const;

  /// All attributes of an object. Those that are neither one number nor one text are left out.
  [[nodiscard]] std::map<std::string, Attribute, std::less<>> attributes(const std::string& object) const;

  /// One column of a compound table.
  [[nodiscard]] std::vector<double> column_numbers(const std::string& table, const std::string& column) const;
  [[nodiscard]] std::vector<int64_t> column_integers(const std::string& table,
                                                     const std::string& column) const;
  [[nodiscard]] std::vector<std::string> column_texts(const std::string& table,
                                                      const std::string& column) const;

  [[noreturn]] void fail(const std::string& place, std::string problem, std::string remedy = {}) const;
  [[nodiscard]] const std::string& file() const { return name_; }

 private:
  struct Column;
  [[nodiscard]] DatasetHandle open_dataset(const std::string& path) const;
  [[nodiscard]] size_t length(const DatasetHandle& dataset, const std::string& path) const;
  [[nodiscard]] Column open_column(const std::string& table, const std::string& column) const;
  template <typename Number>
  [[nodiscard]] std::vector<Number> read_column(const std::string& table, const std::string& column,
                                                hid_t memory_type) const;

  std::string name_;
  FileHandle file_;
};

}  // namespace diastole::runfile
