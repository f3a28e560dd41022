#pragma once
// The report: one self-contained page about any number of run files, fit results, solutions and shear tests.

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

namespace diastole::report {

struct ReportOptions {
  size_t frames = 16;  ///< image frames of a cycle
};

/// The page's HTML. Files are recognised by their content; fits come first, then shear tests,
/// then runs, each in the given order. Throws InputError for a file that is missing, unreadable or of no kind that the report knows.
std::string make_report(std::span<const std::filesystem::path> files, const ReportOptions& options);

}  // namespace diastole::report
