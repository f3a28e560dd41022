#pragma once
// `-o FILE -o FILE ... --force`: several outputs of one command, whose endings say what is written to them.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "estimator/io/finding.hpp"

namespace diastole {

struct OutputKind {
  std::string_view ending;  ///< ".csv"
  std::string_view mark;    ///< of an earlier result, which is replaced (estimator/io/whole_file.hpp)
};

inline constexpr OutputKind vtkhdf_kind{".vtkhdf", "HDF\r\n"};

struct OutputFiles {
  std::vector<std::filesystem::path> files;
  bool force = false;

  /// Adds -o and --force. The object must live until the command has run.
  void add_options(CLI::App& command, const std::string& kinds_in_words);
  /// Before the work. Throws InputError with this problem and remedy if a file has another ending, or if it may not be
  /// replaced.
  void require(const std::vector<std::filesystem::path>& inputs, std::span<const OutputKind> kinds,
               const std::string& problem, const std::string& remedy) const;
};

// Findings for people.

/// Two lines a finding: what and where, and the remedy.
void print_findings(const std::vector<Finding>& findings, std::FILE* stream);

}  // namespace diastole
