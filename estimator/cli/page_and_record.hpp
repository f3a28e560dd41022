#pragma once
// `--page FILE --record FILE`: the page to look at, and the same for `diastole report`.

#include <filesystem>
#include <optional>

#include "estimator/io/whole_file.hpp"
#include "estimator/report/report.hpp"

namespace diastole {

/// `make` gives the record, and is asked only if one of the two is wanted.
template <class MakeRecord>
void write_page_and_record(const std::optional<std::filesystem::path>& page,
                           const std::optional<std::filesystem::path>& record, const MakeRecord& make) {
  if (!page && !record) return;
  const auto made = make();
  if (page) write_whole_file(*page, report::make_report(made));
  if (record) write_whole_file(*record, to_json(made));
}

}  // namespace diastole
